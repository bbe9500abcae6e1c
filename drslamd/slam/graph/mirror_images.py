"""Robots whose odometry tells the mirror image of their way.

Wheels that both run backwards and sides that are swapped do that, and windows tell it of one of two
robots, not of which. So who is the mirror image of a group, that is of two robots or more that are
not of each other, is taken for the one that is wired wrongly: its way counts with its turns the
other way, and its ranges serve the group. Where it stands is known then, and how it is turned but
for half a turn, for nobody knows which of the two mistakes it was. So it is in the group and not of
it: it joins nobody to anybody else, and the frame of the group is never its own.
"""

from __future__ import annotations

from drslamd.conventions import Segment
from drslamd.slam.graph import team_frame
from drslamd.slam.graph.pose_graph import PoseGraph


def with_mirrored(
    current: Segment, members: set[Segment], graph: PoseGraph
) -> tuple[set[Segment], frozenset[Segment]]:
    """Members and mirrored segments of the group of a robot that is in `current`.

    Args:
        members: of its group by closures; where it is in none, it may be the mirror image of one.
    """
    ends = [(joint.a, joint.b) for joint in team_frame.joints(graph) if joint.is_mirrored]
    if not ends:
        return members, frozenset()
    groups = team_frame.groups(graph)
    placed = {segment.chain for group in groups for segment in group}
    seen = {
        (known, odd)
        for a, b in ends
        for known, odd in ((a, b), (b, a))
        if known.chain in placed and odd.chain not in placed
    }
    if not members:
        known_by = {known for known, odd in seen if odd.chain == current.chain}
        members = min((group for group in groups if group & known_by), key=min, default=set())
    return members, frozenset(odd for known, odd in seen if known in members)
