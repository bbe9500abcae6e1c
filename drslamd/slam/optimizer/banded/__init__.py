"""Module 3 by default: the whole team's ranges and odometry, solved exactly by a banded factor.

Entry: `banded_optimizer.BandedOptimizer.job`; equations in `normal_equations`, the solve in `banded_solver`.
"""
