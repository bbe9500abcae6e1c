"""Sight that is blocked: for a while between some robots, or by a wall that has come between two.

Wheels that stood or spun explain a wall as well, while it is new: a way of one second that nobody
saw. What tells them apart is a third robot that sees both, and that a wall makes ranges longer by
the same from one second to the next.
"""
