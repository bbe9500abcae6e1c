"""``tools/report``: a run as one page, with everything that says why it came out so."""
