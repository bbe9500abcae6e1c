"""The graph that module 3 solves: recent times whole, old times thinned.

What robots said stays as they said it (`ChainData`, `PairData`); this graph is a view of it, and
follows from it alone. So robots that hold the same measurements hold the same graph, bit for bit,
in whatever order these came. Entry: `graph_view.Thinning.steps`.
"""
