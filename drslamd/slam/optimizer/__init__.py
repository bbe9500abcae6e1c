"""Module 3, paper section III-C: pose graph optimisation, by one of three solvers.

`contract.Optimizer` is what each of them is: graph in, a computation out, an estimate from it. The
rooms are `banded` (default: ranges and odometry of the team, exact), `closures` (the paper's cost,
exact) and `rbcd` (the paper's Riemannian block coordinate descent).
"""
