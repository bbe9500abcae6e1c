"""What the programs end with: the codes of sysexits.h, which systemd and scripts can read."""

OK, USAGE, UNAVAILABLE, BUG, CANNOT_CREATE, BAD_CONFIG = 0, 64, 69, 70, 73, 78
