"""The laptop's side of drslamd: recordings, simulated worlds, emulated sensors, scores."""
