"""Checks of the machine, beside those of `drslamd.machine` that a start needs."""
