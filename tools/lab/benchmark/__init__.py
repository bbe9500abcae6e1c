"""Each module of drslamd beside its peers, on the same inputs in one run."""
