"""How a robot is set up: what was found and chosen becomes a file, what a tape says a number.

Pure: the verbs ``init`` and ``calibrate`` open ports, ask people and write.
"""
