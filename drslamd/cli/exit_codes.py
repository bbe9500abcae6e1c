"""What the programs end with: the codes of sysexits.h, which systemd and scripts can read."""

OK, USAGE, UNAVAILABLE, BUG, CANNOT_CREATE, BAD_CONFIG = 0, 64, 69, 70, 73, 78
ALREADY_RUNS = 75
"""EX_TEMPFAIL: it can be tried again when the other daemon has ended."""
FOUND = 1
"""Something is wrong that somebody can mend; as of grep and diff."""
