"""Module 3 as the paper has it (section III-C): Riemannian block coordinate descent.

Each robot optimises its own block and exchanges only its public poses. Entry:
`rbcd_optimizer.RbcdOptimizer.job`; the step is `riemannian_descent.descend`.
"""
