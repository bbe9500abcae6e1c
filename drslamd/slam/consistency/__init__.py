"""Module 2, paper section III-B: pairwise consistency maximisation throws out wrong closures.

Equation (3) is the test of two closures, the largest set that passes it is a clique. Entry:
`pair.PairTracker.begin_check`; the test is in `pcm`, the set in `incremental_clique`.
"""
