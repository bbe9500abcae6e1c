"""How one robot is, as an onlooker sees it: its state, whom it hears, and what is wrong with it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from drslamd.conventions import Chain
from drslamd.gossip.message_types import PoseState, Status
from drslamd.reports import hypothesis_report
from drslamd.view.scene.possible_seen import PossibleSeen
from drslamd.view.scene.robot_path import RobotPath

SILENCE_S = 5.0
"""A robot says something every second, every third without news; a longer silence is a loss."""
BEGAN_S = 60.0
"""So long a start is spoken of."""
NAMED = 4
"""Robots that a sentence names; of more it says the number."""


class RobotSeen:
    """One start of one robot.

    Attributes:
        state: what it says of its pose, in its latest pose or heartbeat.
        heard: when it was heard last, s; began: when this start was heard first.
        is_first: is it the first start that was heard of this robot?
        possible: where it says that others may be.
    """

    def __init__(self, chain: Chain, t: float) -> None:
        self.chain = chain
        self.path = RobotPath()
        self.possible = PossibleSeen()
        self.state = PoseState.NOT_LOCALISED
        self.status: Status | None = None
        self.heard = self.began = t
        self.is_first = True

    def begin_again(self, chain: Chain, t: float) -> None:
        """It speaks under another epoch."""
        self.chain, self.began, self.is_first = chain, t, False
        self.state, self.status = PoseState.NOT_LOCALISED, None
        self.path.begin_again()
        self.possible = PossibleSeen()

    def speaks(self, t: float) -> bool:
        """Was it heard of late, and did it not say goodbye?"""
        return t - self.heard < SILENCE_S and not self.is_leaving

    @property
    def is_leaving(self) -> bool:
        return self.status is not None and self.status.leaving

    @property
    def sigma_m(self) -> float | None:
        """Of its position, in the direction in which it is known least; None without a pose."""
        if self.state is PoseState.NOT_LOCALISED or self.path.frame is None:
            return None
        return math.sqrt(max(0.0, float(np.linalg.eigvalsh(self.path.covariance[:2, :2])[-1])))

    @property
    def hears(self) -> list[int]:
        return sorted(h.id for h in self.status.heard) if self.status else []

    @property
    def ranges(self) -> list[int]:
        return sorted(self.status.ranged) if self.status else []


def picture(seen: RobotSeen, team: Mapping[int, RobotSeen], t: float) -> dict[str, Any]:
    """What the page says of a robot: a flat object, ready for JSON."""
    frame = seen.path.frame
    sigma, status = seen.sigma_m, seen.status
    return {
        "id": seen.chain.robot,
        "state": int(seen.state),
        "frame": None if frame is None else frame.robot,
        "frame_key": None if frame is None else f"{frame.robot}/{frame.epoch}",
        "heard": round(seen.heard, 2),
        "leaving": seen.is_leaving,
        "sigma_m": None if sigma is None else round(min(sigma, 1e6), 3),
        "hears": seen.hears,
        "ranges": seen.ranges,
        "lacks": _lacking(status),
        "uwb": None if status is None else status.uwb_id,
        "words": sentences(seen, team, t),
    }


def sentences(seen: RobotSeen, team: Mapping[int, RobotSeen], t: float) -> list[str]:
    """What is wrong with a robot, the cause before its consequences."""
    if seen.is_leaving:
        return ["has said goodbye"]
    if not seen.speaks(t):
        return ["is not heard any more: switched off, or out of reach"]
    out = [*_speech(seen, team, t), *_state(seen), *_possible(seen, t)]
    if t - seen.began < BEGAN_S and not seen.is_first:
        out.append(f"began again {t - seen.began:.0f} s ago")
    return out


def _speech(seen: RobotSeen, team: Mapping[int, RobotSeen], t: float) -> list[str]:
    """Of radio and network."""
    own, status = seen.chain.robot, seen.status
    if status is None:
        return ["no heartbeat of it was heard yet"]
    out = []
    others = [r for r in team.values() if r.chain.robot != own and r.speaks(t) and r.status]
    twins = [r.chain.robot for r in others if r.status and r.status.uwb_id == status.uwb_id]
    if twins:
        out.append(f"claims UWB module {status.uwb_id}, as {names(twins)} does")
    if others and not seen.hears:
        out.append("hears no other robot: look at its network interface and firewall")
    deaf = [r.chain.robot for r in others if own not in r.hears and r.chain.robot in seen.hears]
    if deaf:
        out.append(f"hears {names(deaf)} but is not heard there: multicast passes one way")
    if others and not seen.ranges:
        out.append("measures ranges to nobody: out of UWB reach, or its module is silent")
    lacks = _lacking(status)
    if lacks:
        out.append(f"waits for {lacks} messages of the others' logs")
    return out


def _state(seen: RobotSeen) -> list[str]:
    if seen.state is PoseState.NOT_LOCALISED:
        return ["is not localised yet: it has to meet and drive curves; drslamd status says more"]
    if seen.state is PoseState.DOUBTFUL:
        return ["is in doubt: measurements contradict its pose; look at its wheels and antenna"]
    if seen.state is PoseState.STALE:
        return ["has no odometry: the pose is its last one; cable and power of the base"]
    if seen.state is PoseState.POSITION:
        return [
            "its place is known, its heading is not: it stands, or its wheels are wired wrongly"
        ]
    return []


def _possible(seen: RobotSeen, t: float) -> list[str]:
    said = seen.possible.latest(t)
    return [row["what"] for row in hypothesis_report.rows(said, seen.chain.robot, 0)]


def _lacking(status: Status | None) -> int:
    """Log entries that it has heard of and does not hold."""
    # (the first row of a log says where its first gap is)
    first_rows = {log.id: log for log in reversed(status.logs)} if status else {}
    return sum(log.newest - log.complete for log in first_rows.values())


def names(robots: list[int]) -> str:
    """robot 3; robots 3 and 5; 7 robots."""
    if len(robots) > NAMED:
        return f"{len(robots)} robots"
    numbers = " and ".join(map(str, sorted(robots)))
    return f"robot {numbers}" if len(robots) == 1 else f"robots {numbers}"
