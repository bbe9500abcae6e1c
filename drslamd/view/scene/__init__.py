"""What an onlooker knows of a team, from its messages alone; no clock, no socket, no file.

`hearing` judges what comes in, `robot_path` keeps where one robot was, `pair_seen` what two robots
measured between them, `robot_seen` how a robot is, `scene` puts them together for the page.
"""
