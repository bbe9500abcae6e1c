"""After a hole in its odometry: where a robot is by ranges to localised peers.

While the wheels are silent a `Cloud` of places is carried by how fast the robot drives, and weighed
by `Sightings`. Once they count again `placing` finds where what they count begins.
A robot that began again is placed in the same way (`resumption`), from where its last start was
(`last_place`).
"""
