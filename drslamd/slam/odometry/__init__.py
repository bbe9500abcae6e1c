"""Dead reckoning: wheel motions become a track on a 10 Hz grid, and how wrong that track may be.

The paper takes odometry as given (section IV-A: 10 Hz). Entry: `dead_reckoning.DeadReckoning.add`;
`track.Track` holds the samples and `noise.OdometryNoise` is the one model of how they err.
"""
