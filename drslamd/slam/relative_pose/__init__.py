"""Module 1, paper section III-A: the pose of one robot seen from another, from a short window.

Equation (1) is the residual of a window, equation (2) the set that algorithm 1 searches. Entry:
`solver.solve`; `algorithm_1.solve` is algorithm 1 and its refinement as printed.
"""
