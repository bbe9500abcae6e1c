"""tools/reproduce: the paper's experiment made anew, its algorithms and ours on the same data."""
