"""What stands and is heard: parked robots, and modules that no robot carries.

`point_search` says where such a thing stands, in the odometry of a robot that drives past;
`point_tracker` follows one of them until it is told, and lets it go when it was moved; `points` is
all of them as one robot knows them.
"""
