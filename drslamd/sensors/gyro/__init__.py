"""Heading from a gyro that a base has anyway.

`heading_track` puts readings on one growing angle; `turn_fit` and `comparison` hold that against
the wheels, and say which of both is wrong; `rest` learns the bias;
`gyro_heading.GyroHeading.turned` gives motions the better turn.
"""
