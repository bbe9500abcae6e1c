"""Every reason that a status, a log or a counter may show has its row on the page of reasons."""

from __future__ import annotations

import ast
import re
from enum import Enum
from pathlib import Path

import pytest
from places import REPOSITORY

from drslamd.conditions.health import CAUSES_FIRST
from drslamd.events import PortCondition
from drslamd.gossip.lc02 import FramingFault
from drslamd.gossip.membership.namesakes import NamesakeFault
from drslamd.gossip.message_types import PoseState
from drslamd.gossip.seal import SealFault
from drslamd.gossip.starts import StartFault
from drslamd.sensors.gyro.comparison import GyroFault
from drslamd.sensors.linktrack.codec import Refusal
from drslamd.sensors.linktrack.linktrack_input import RangeRefusal
from drslamd.sensors.wheels.wheel_base import Gap, ReadingRefusal
from drslamd.sensors.wheels.wheel_driver import WheelRefusal
from drslamd.slam.relative_pose.estimate import Verdict

PACKAGE = REPOSITORY / "drslamd"
PAGE = PACKAGE / "conditions" / "README.md"
BY_NAME: dict[str, type[Enum]] = {
    "frames.refused.": Refusal,
    "ranges.refused.": RangeRefusal,
    "messages.refused.": WheelRefusal,
    "samples.refused.": ReadingRefusal,
    "gaps.": Gap,
    "gyro.faults.": GyroFault,
}
"""Counters, by what stands before the reason."""
BY_VALUE: list[type[Enum]] = [FramingFault, SealFault, StartFault, NamesakeFault, Verdict]
"""Those that are shown as they are."""


def rows() -> dict[str, list[str]]:
    """Cells of each row by its first one, a code between backticks."""
    lines = [line.strip("| \n").split(" | ") for line in PAGE.read_text().splitlines()]
    return {cells[0].strip("`"): cells[1:] for cells in lines if re.fullmatch("`.+`", cells[0])}


def said_in(path: Path, pattern: str) -> set[str]:
    return set(re.findall(pattern, path.read_text()))


def texts_returned(path: Path) -> set[str]:
    """Reasons that a module gives as plain texts."""
    nodes = ast.walk(ast.parse(path.read_text()))
    values = [node.value for node in nodes if isinstance(node, ast.Return)]
    return {v.value for v in values if isinstance(v, ast.Constant) and isinstance(v.value, str)}


def reasons() -> set[str]:
    names = {f"{start}{member.name}" for start, kind in BY_NAME.items() for member in kind}
    values = {str(member.value) for kind in BY_VALUE for member in kind}
    ports = {member.value for member in PortCondition if member is not PortCondition.OPEN}
    states = {member.name.lower().replace("_", " ") for member in PoseState}
    plain = said_in(PACKAGE / "gossip" / "team.py", r'self\.refused\["(.+?)"\]')
    plain |= texts_returned(PACKAGE / "gossip" / "envelopes" / "opening.py")
    plain |= said_in(PACKAGE / "slam" / "front_end.py", r'\.count\("(.+?)"\)')
    plain |= texts_returned(PACKAGE / "slam" / "relative_pose" / "window_request.py")
    return names | values | ports | states | plain | set(CAUSES_FIRST)


def test_every_reason_has_a_row_and_no_row_is_of_a_reason_that_is_gone() -> None:
    assert set(rows()) == reasons()


@pytest.mark.parametrize("code", sorted(reasons()))
def test_a_row_says_what_it_means_and_what_to_do(code: str) -> None:
    meaning, remedy = rows()[code]
    assert len(meaning) > 5
    assert len(remedy) > 5


def test_every_condition_that_the_daemon_looks_after_is_ranked() -> None:
    from robot_scenes import RobotScene

    from drslamd.conditions.diagnosis import conditions

    scene = RobotScene()
    assert {key for key, _ in conditions(scene.robot, scene.utime)} == set(CAUSES_FIRST)
