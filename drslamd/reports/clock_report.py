"""What a robot knows of the clocks of others, for whoever puts their stamps on one clock."""

from __future__ import annotations

from typing import Any

from drslamd.conventions import GRID_US, SECOND_US, Chain
from drslamd.robot import Robot

MEASURED_US = 2 * SECOND_US
"""How wrong a clock is that only measurements tell (`slam.graph.clocks`): their two keyframes may
be a second and a half from each other."""


def clock(robot: Robot, chain: Chain, utime: int) -> dict[str, Any]:
    """One robot's clock against ours.

    Returns:
        `readings`: rows of our time, that clock minus ours and how wrong that may be, us, in the
        order of time; empty when nothing is known. `source`: who says so.
    """
    if chain == robot.own:
        return {"source": "own", "readings": [[utime, 0, 0]]}
    peer = robot.team.peers.get(chain.robot)
    if peer is not None and peer.chain == chain:
        now = peer.clock.offset(utime)
        readings = [list(reading) for reading in peer.clock_history.readings]
        if not readings and now is not None:
            readings = [[utime, now.us, now.uncertainty_us]]
        if readings:
            return {"source": now.source if now else "messages", "readings": readings}
    return _measured(robot, chain, utime)


def _measured(robot: Robot, chain: Chain, utime: int) -> dict[str, Any]:
    """As ranges and closures tell of a robot that is no longer heard."""
    graph, own = robot.back.graph, robot.own.robot
    shifts = robot.back.looked_at.shifts
    is_held = chain.robot in graph.chains and graph.chains[chain.robot].chain == chain
    if not is_held or not {own, chain.robot} <= set(shifts):
        return {"source": "unknown", "readings": []}
    ahead_us = round((shifts[chain.robot] - shifts[own]) * GRID_US)
    return {"source": "measurements", "readings": [[utime, ahead_us, MEASURED_US]]}
