"""What a daemon tells of its pose and its peers, in the words of other programs.

Each feed is a process of its own: messages of the local socket in (`stream`), the other's format
out. None of their packages is needed on a robot that feeds nobody.
"""
