"""Where we are and who is around us, at the rate of our odometry: for whoever steers by it.

Nothing is solved here. What module 3 solved last is carried on by odometry (`leg`), seen from where
we are now (`relative`), and told with the frames of REP 105 (`surroundings`), as `near_message` has
it in bytes.
"""
