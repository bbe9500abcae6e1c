"""Where robots really drive: alone, in line, beside each other in lanes, or nowhere.

Each function draws the true trajectories (n, 3) of all robots of a scene, one pose per STEP_S.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lab.recordings import world
from lab.recordings.recording import Array
from lab.recordings.world import STEP_S, Scene

GAP_M = 1.5
"""Between robots in line, along the way."""
TURN_M = 0.3
"""A turn of one radian counts as so much way: who follows turns no faster than who leads."""
LEAD_S = 30.0
"""The first in line has driven so long before the scene begins."""

LANE_M, APART_M = 9.0, 6.0
"""Length of a lane, and from one lane to the next."""
LANE_MPS = (0.45, 0.43)
"""Speeds in the lanes, in turn: the robots do not stay side by side."""
LANE_TURN_RADPS = 1.4

SPOT_M = (2.0, 8.0)
"""How far apart robots turn on the spot."""
SPOT_RADPS, SPOT_S = (0.3, 0.9), (3.0, 8.0)
"""Speeds of such turns, and how long each takes before the next one or a rest."""
SPOT_REST = 0.25
"""Share of rests."""


def each_alone(rng: np.random.Generator, scene: Scene) -> list[Array]:
    """Towards goals of their own."""
    return [world.drive(rng, scene) for _ in range(scene.robots)]


def in_line(rng: np.random.Generator, scene: Scene) -> list[Array]:
    """One behind the other on the path of the first."""
    lead = world.drive(rng, replace(scene, seconds=scene.seconds + LEAD_S))
    step = np.diff(lead, axis=0)
    effort = np.hypot(step[:, 0], step[:, 1]) + TURN_M * np.abs(step[:, 2])
    # strictly ascending, also while the first one stands
    way = np.concatenate([[0.0], np.cumsum(effort + 1e-9)])
    first = len(lead) - round(scene.seconds / STEP_S)
    return [_at(lead, way, way[first:] - GAP_M * k) for k in range(scene.robots)]


def _at(path: Array, way: Array, wanted: Array) -> Array:
    """(k, 3) poses of a path where `wanted` (k,) m of its way (n,) are driven."""
    return np.stack([np.interp(wanted, way, column) for column in path.T], axis=-1)


def lanes(rng: np.random.Generator, scene: Scene) -> list[Array]:
    """Patrols: each robot up and down a lane of its own that wavers as people steer."""
    return [
        _lane(rng, k * APART_M, LANE_MPS[k % len(LANE_MPS)], scene.seconds)
        for k in range(scene.robots)
    ]


def _lane(rng: np.random.Generator, y_m: float, speed: float, seconds: float) -> Array:
    """There and back along a sum of waves about y = `y_m`, with half a turn at both ends."""
    size, length, phase = rng.uniform(0.2, 0.5, 3), rng.uniform(3, 9, 3), rng.uniform(0, 6.28, 3)
    x = np.linspace(-LANE_M / 2, LANE_M / 2, 2000)
    angle = 2 * np.pi * x[:, None] / length + phase
    y = y_m + (size * np.sin(angle)).sum(axis=1) / 1.5
    slope = (2 * np.pi * size / length * np.cos(angle)).sum(axis=1) / 1.5
    there = np.column_stack([x, y, np.arctan(slope)])
    back = there[::-1] + [0.0, 0.0, np.pi]
    again = there[:1] + [0.0, 0.0, 2 * np.pi]
    loop = np.concatenate([there, back, again])
    step = np.diff(loop, axis=0)
    takes = np.hypot(step[:, 0], step[:, 1]) / speed
    takes += np.where(takes > 0, 0.0, np.abs(step[:, 2]) / LANE_TURN_RADPS)
    at = np.concatenate([[0.0], np.cumsum(takes)])
    t = np.arange(round(seconds / STEP_S)) * STEP_S
    poses = _at(loop, at, t % at[-1])
    poses[:, 2] += 2 * np.pi * (t // at[-1])
    return poses


def on_the_spot(rng: np.random.Generator, scene: Scene) -> list[Array]:
    """Nobody drives: each turns in place, this way and that, and rests now and then."""
    count = round(scene.seconds / STEP_S)
    out = []
    x = 0.0
    for _ in range(scene.robots):
        rate = np.zeros(count)
        k = 0
        while k < count:
            until = k + round(rng.uniform(*SPOT_S) / STEP_S)
            turn = rng.uniform(*SPOT_RADPS) * rng.choice([-1.0, 1.0])
            rate[k:until] = 0.0 if rng.random() < SPOT_REST else turn
            k = until
        heading = rng.uniform(-np.pi, np.pi) + np.cumsum(rate) * STEP_S
        out.append(np.column_stack([np.full(count, x), np.zeros(count), heading]))
        x += rng.uniform(*SPOT_M)
    return out
