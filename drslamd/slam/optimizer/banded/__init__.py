"""Module 3 by default: the whole team's ranges and odometry, solved exactly by a banded factor.

Entry: `banded_optimizer.BandedOptimizer.job`. The unknowns are ordered in `layout`; `linearised`
makes factors of them at a `point`, `normal_equations` a system (`assembly`), `band_factor` takes it
apart, `newton_descent` goes down to the solution. `misfit` says what does not fit there,
`explanation` what explains it: wheels that stood or spun (`lapses`), `mountings` that are not as
configured, or odometry that was worse (`odometry_levels`).
`claims` says how sure the answer is. `banded_solver` does it all.
"""
