"""A robot that lost its way once: which links of its odometry were wrong (`releases`), and where it
is since then (`breaks`)."""
