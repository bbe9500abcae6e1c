"""Module 3 by default: the whole team's ranges and odometry, solved exactly by a banded factor.

Entry: `banded_optimizer.BandedOptimizer.job`. The unknowns are ordered in `layout`; `linearised`
makes factors of them, `normal_equations` a system, `band_factor` takes it apart, `newton_descent`
goes down to the solution. `misfit` says what does not fit there, `odometry_levels` who must be
believed less, `claims` how sure the answer is. `banded_solver` does it all.
"""
