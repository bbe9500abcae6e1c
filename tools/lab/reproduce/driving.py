"""How somebody with a joystick drives a robot about a room: curves, straight lines, stops.

The stick is held for some seconds and then moved; near a wall it turns the robot back inwards.
"""

from __future__ import annotations

import numpy as np

from lab.recordings.recording import Array
from lab.recordings.world import STEP_S, Scene

HOLD_S = (1.5, 5.0)
STOP_S = (1.0, 3.0)
CURVE, STRAIGHT, TURN = 0.60, 0.25, 0.10
"""Shares of what the stick is moved to; the rest are stops."""
CURVE_RAD_PER_S = 0.4
TURN_RAD_PER_S = 0.6
WALL_M, LOOK_AHEAD_M = 1.0, 0.8
SPEED_STEP, TURN_STEP = 0.02, 0.03
"""m/s and rad/s by which a command can change what the wheels do in one step."""


def by_hand(rng: np.random.Generator, scene: Scene) -> Array:
    """(n, 3) true poses, one per STEP_S."""
    room = np.array([scene.width, scene.height])
    pose = np.array([*rng.uniform(1.5 * WALL_M, room - 1.5 * WALL_M), rng.uniform(-np.pi, np.pi)])
    poses = np.empty((round(scene.seconds / STEP_S), 3))
    speed = turn = 0.0
    wanted, until = (0.0, 0.0), 0.0
    for k in range(len(poses)):
        poses[k] = pose
        if k * STEP_S >= until:
            wanted, held = _stick(rng, scene.speed)
            until = k * STEP_S + held
        to_speed, to_turn = _off_the_wall(pose, wanted, room)
        speed += np.clip(to_speed - speed, -SPEED_STEP, SPEED_STEP)
        turn += np.clip(to_turn - turn, -TURN_STEP, TURN_STEP)
        middle = pose[2] + turn * STEP_S / 2
        pose = pose + STEP_S * np.array([speed * np.cos(middle), speed * np.sin(middle), turn])
    return poses


def _stick(rng: np.random.Generator, speed: float) -> tuple[tuple[float, float], float]:
    """Speed, turn rate, and for how long they are held."""
    what, held = rng.random(), rng.uniform(*HOLD_S)
    forward = speed * rng.uniform(0.8, 1.0)
    if what < CURVE:
        return (forward, rng.uniform(-CURVE_RAD_PER_S, CURVE_RAD_PER_S)), held
    if what < CURVE + STRAIGHT:
        return (speed, 0.0), held
    if what < CURVE + STRAIGHT + TURN:
        return (0.3 * speed, rng.choice([-1, 1]) * TURN_RAD_PER_S), held
    return (0.0, 0.0), rng.uniform(*STOP_S)


def _off_the_wall(pose: Array, wanted: tuple[float, float], room: Array) -> tuple[float, float]:
    """The command, or a turn towards the middle when it would lead to the wall."""
    ahead = pose[:2] + LOOK_AHEAD_M * np.array([np.cos(pose[2]), np.sin(pose[2])])
    if not wanted[0] or bool(((ahead > WALL_M) & (ahead < room - WALL_M)).all()):
        return wanted
    to_middle = room / 2 - pose[:2]
    away = np.arctan2(to_middle[1], to_middle[0]) - pose[2]
    away = (away + np.pi) % (2 * np.pi) - np.pi
    return 0.8 * wanted[0], float(np.sign(away)) * TURN_RAD_PER_S
