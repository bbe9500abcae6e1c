"""Wheel bases by serial line and CAN: bytes become motions.

Entry: `wheel_input.WheelInput.feed`.
"""
