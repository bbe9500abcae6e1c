"""Scores of trajectories and relative poses, one schema for every source.

A team is aligned by one SE(2) for all robots together; dead reckoning that was given the true
start poses is not aligned at all.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from lab.recordings.recording import Array

Errors = dict[str, float]


def wrapped(angle: Array) -> Array:
    return np.asarray((angle + np.pi) % (2 * np.pi) - np.pi)


def compose(a: Array, b: Array) -> Array:
    """Product of poses (..., 3)."""
    cos, sin = np.cos(a[..., 2]), np.sin(a[..., 2])
    x = a[..., 0] + cos * b[..., 0] - sin * b[..., 1]
    y = a[..., 1] + sin * b[..., 0] + cos * b[..., 1]
    return np.stack([x, y, a[..., 2] + b[..., 2]], axis=-1)


def relative(a: Array, b: Array) -> Array:
    """Pose of b in the frame of a, for poses (..., 3) in one frame."""
    cos, sin = np.cos(a[..., 2]), np.sin(a[..., 2])
    dx, dy = b[..., 0] - a[..., 0], b[..., 1] - a[..., 1]
    return np.stack(
        [cos * dx + sin * dy, cos * dy - sin * dx, wrapped(b[..., 2] - a[..., 2])], axis=-1
    )


def alignment(estimate: Array, truth: Array) -> Array:
    """The SE(2) (3,) that brings positions (n, 2) closest to others (n, 2), least squares."""
    mean_e, mean_t = estimate.mean(axis=0), truth.mean(axis=0)
    h = (estimate - mean_e).T @ (truth - mean_t)
    angle = np.arctan2(h[0, 1] - h[1, 0], h[0, 0] + h[1, 1])
    cos, sin = np.cos(angle), np.sin(angle)
    shift = mean_t - np.array([[cos, -sin], [sin, cos]]) @ mean_e
    return np.array([*shift, angle])


def at_times(t: Array, poses: Array, when: Array) -> Array:
    """Poses (k, 3) of a trajectory at times (k,), linear between its samples."""
    angle = np.unwrap(poses[:, 2])
    columns = [np.interp(when, t, c) for c in (poses[:, 0], poses[:, 1], angle)]
    return np.stack(columns, axis=-1)


def errors(
    estimates: Mapping[int, Array], truths: Mapping[int, Array], robot: int | None
) -> Errors:
    """Errors of one robot, or of all together (None), already aligned."""
    robots = sorted(estimates) if robot is None else [robot]
    position = np.concatenate([np.hypot(*(estimates[r] - truths[r])[:, :2].T) for r in robots])
    turns = [np.degrees(wrapped(estimates[r][:, 2] - truths[r][:, 2])) for r in robots]
    centred = [wrapped(np.radians(x - np.median(x))) for x in turns]
    rotation = np.abs(np.concatenate(turns))
    return {
        "ate_rmse_m": float(np.sqrt(np.mean(position**2))),
        "ate_mean_m": float(position.mean()),
        "ate_std_m": float(position.std()),
        "rot_mean_deg": float(rotation.mean()),
        "rot_std_deg": float(rotation.std()),
        "rot_mean_centred_deg": float(np.degrees(np.abs(np.concatenate(centred))).mean()),
    }


def aligned(
    estimates: Mapping[int, Array], truths: Mapping[int, Array], frames: Mapping[int, Array]
) -> dict[int, Array]:
    """Poses (n, 3) per robot, moved onto the truth by one SE(2) for each frame they are in."""
    out = {robot: poses.copy() for robot, poses in estimates.items()}
    for frame in np.unique(np.concatenate(list(frames.values()))):
        where = {robot: frames[robot] == frame for robot in estimates}
        shift = alignment(
            np.concatenate([estimates[r][w][:, :2] for r, w in where.items()]),
            np.concatenate([truths[r][w][:, :2] for r, w in where.items()]),
        )
        for robot, inside in where.items():
            out[robot][inside] = compose(shift[None], estimates[robot][inside])
    return out


def team_errors(estimates: Mapping[int, Array], truths: Mapping[int, Array]) -> dict[str, Any]:
    """``{"robots": {id: errors}, "team": errors}`` of poses (n, 3) per robot, as they are."""
    return {
        "robots": {str(r): errors(estimates, truths, r) for r in sorted(estimates)},
        "team": errors(estimates, truths, None),
    }


def pair_errors(relative_poses: Array, truths: Array) -> dict[str, float]:
    """Median and mean errors of relative poses (n, 3)."""
    position = np.hypot(*(relative_poses - truths)[:, :2].T)
    rotation = np.degrees(np.abs(wrapped(relative_poses[:, 2] - truths[:, 2])))
    return {
        "trans_median_m": float(np.median(position)),
        "rot_median_deg": float(np.median(rotation)),
        "trans_mean_m": float(position.mean()),
        "rot_mean_deg": float(rotation.mean()),
    }
