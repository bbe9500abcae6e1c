"""Distributed ranging SLAM for a team of ground robots: UWB ranges, wheel odometry, LCM."""

__version__ = "0.3.0"
