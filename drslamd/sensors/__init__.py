"""Bytes or CAN frames in, samples out: sans-IO codecs, each a state machine without a clock."""
