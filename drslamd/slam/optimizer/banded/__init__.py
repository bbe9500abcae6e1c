"""Module 3 by default: the whole team's ranges and odometry, solved exactly by a banded factor.

Entry: `banded_optimizer.BandedOptimizer.job`. The unknowns are ordered in `layout`, the equations
are those of `normal_equations`, `banded_solver` solves them.
"""
