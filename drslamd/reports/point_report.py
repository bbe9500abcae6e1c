"""What stands around a robot: modules that no robot carries, and parked robots."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drslamd.conventions import FIRST_NODE, is_node
from drslamd.gossip.message_types import PoseState
from drslamd.robot import Robot
from drslamd.slam.points.point_tracker import PointTracker


def modules(robot: Robot) -> dict[str, Any]:
    """Places of modules that no robot carries, in the frame of the team, by UWB id."""
    estimate = robot.back.estimate
    out: dict[str, Any] = {}
    for number, path in sorted(estimate.nodes.items()) if estimate is not None else ():
        assert estimate is not None
        covariance = estimate.covariance(number)
        if covariance is None or not len(path.n):
            continue
        x, y, _ = path.poses[-1].tolist()
        xx, xy, yy = (float(covariance[k]) for k in ((0, 0), (0, 1), (1, 1)))
        sigma = float(np.sqrt(np.linalg.eigvalsh(covariance[:2, :2])[-1]))
        out[str(number - FIRST_NODE)] = {
            "x_m": round(x, 4),
            "y_m": round(y, 4),
            "sigma_m": round(sigma, 4),
            "covariance_m2": [xx, xy, yy],
        }
    return out


def site(robot: Robot, utime: int) -> dict[str, Any] | None:
    """The frame of the site, and this robot in it; None where no module has coordinates."""
    found, survey = robot.standing.site(), robot.standing.survey
    if found is None or survey is None:
        return None
    if isinstance(found, str):
        return {"why_not": found}
    out: dict[str, Any] = {
        "site_T_team": [round(float(v), 6) for v in found.site_T_w],
        "sigma_deg": round(math.degrees(math.sqrt(float(found.covariance[2, 2]))), 3),
        "sigma_m": round(math.sqrt(float(np.linalg.eigvalsh(found.covariance[:2, :2])[-1])), 4),
        "modules": list(found.used),
        "left_out": list(found.left_out),
        "off_m": round(found.off_m, 4),
        "origin_deg": None if survey.origin is None else list(survey.origin),
    }
    where = robot.whereabouts(utime)
    if where.pose is not None:
        pose, covariance = found.pose(where.pose)
        out |= {"x_m": round(float(pose[0]), 4), "y_m": round(float(pose[1]), 4)}
        if where.state is not PoseState.POSITION:
            out["theta_deg"] = round(math.degrees(float(pose[2])), 3)
        out["own_sigma_m"] = round(math.sqrt(float(np.linalg.eigvalsh(covariance[:2, :2])[-1])), 4)
    return out


def points(robot: Robot) -> dict[str, Any]:
    """What this robot has found of them by itself, by UWB id: places are as seen from its body."""
    trackers = robot.front.points.trackers
    return {str(uwb_id): _point(tracker) for uwb_id, tracker in sorted(trackers.items())}


def _point(tracker: PointTracker) -> dict[str, Any]:
    found, number = tracker.found, tracker.target.chain.robot
    candidates = found.candidates if found is not None else ()
    return {
        "robot": None if is_node(number) else number,
        "told": tracker.told is not None,
        "verdict": found.verdict if found is not None else "no search yet",
        "candidates": [
            {
                "x_m": round(float(one.place[0]), 3),
                "y_m": round(float(one.place[1]), 3),
                "sigma_m": round(one.sigma_m, 3),
            }
            for one in candidates
        ],
    }
