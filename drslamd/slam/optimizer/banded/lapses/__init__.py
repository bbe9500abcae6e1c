"""Lapses: stretches along which wheels stood or spun while the robot drove otherwise.

Odometry that is believed less bit by bit (`odometry_levels`) bends into a wrong way when much is
wrong at once. But wheels show where that may have been: where they stand for seconds, where one of
two does, so that the robot turns about it in its own eyes, and where they turn faster than that
robot ever drives. Where a solution does not fit, each such stretch is
freed: along it a robot may have done whatever it can, while it lasts on that side of two others on
which its way bends less (`mirrors`). The best of them is the reason if with it all fits. It is
known from then on, as long as the robot did something else there than its wheels say.
"""
