"""The pose graph of the team, as every robot holds it: measurements, frame, estimate, thinning.

Paper, section III-C: keyframes are the nodes, odometry and kept closures join them. Entry:
`pose_graph.PoseGraph.insert`; `team_frame.groups` says who is connected.
"""
