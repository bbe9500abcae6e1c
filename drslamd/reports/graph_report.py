"""The team's pose graph as a robot holds and solves it, as tables for files.

A table is ``{"columns": [...], "rows": [[...], ...]}``; every column has its unit in its name
(`_m`, `_rad`, squares of them); one word is a number of a robot, a key of a keyframe, a state or
a `utime`, us on the clock of the robot that it is of. A table is bounded by the newest
`MOST_ROWS`; `left_out` says how many older rows are not in it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drslamd.conventions import FIRST_NODE, GRID_US
from drslamd.history import pose_history
from drslamd.reports import clock_report, point_report
from drslamd.robot import Robot
from drslamd.slam import se2, settings
from drslamd.slam.graph import mirror_images, standing_points, team_frame
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.team_frame import Group
from drslamd.slam.optimizer import factors
from drslamd.slam.optimizer.banded.banded_optimizer import TeamProblem, build_problem
from drslamd.slam.optimizer.factor_errors import corrected, range_errors
from drslamd.slam.optimizer.problem import BetweenFactors
from drslamd.slam.se2 import Array

MOST_ROWS = 10_000
"""Of one table: the keyframes that twenty robots have after thinning. A full one is a megabyte of
JSON and holds up a daemon for a tenth of a second."""
SMALLEST = 1e-12
"""m^2 and rad^2; what is smaller is none."""
DIGITS = 6
"""Micrometres, and 0.1 mrad of a variance."""
KEYFRAME_COLUMNS = (
    *("key", "robot", "utime", "x_m", "y_m", "theta_rad"),
    *("odometry_x_m", "odometry_y_m", "odometry_theta_rad"),
)
"""Where a keyframe is in the frame of the team, and where its robot's odometry has it."""
EDGE_COLUMNS = (
    *("i", "j", "x_m", "y_m", "theta_rad"),
    *("xx_m2", "xy_m2", "xt_m_rad", "yy_m2", "yt_m_rad", "tt_rad2"),
)
"""Pose of keyframe j in the frame of keyframe i, and its covariance; keys as `keyframes` numbers
them."""


def graph(robot: Robot, utime: int) -> dict[str, Any]:
    """Keyframes with their solved poses, odometry, closures and ranges between them, the poses that
    were published of late, and all clocks against ours."""
    estimate, own = robot.back.estimate, robot.own
    out: dict[str, Any] = {"robot": own.robot, "epoch": own.epoch, "utime": utime, "frame": None}
    out["poses"] = _published(robot)
    chains = {own.robot: own} | {k: peer.chain for k, peer in robot.team.peers.items()}
    if estimate is not None:
        out["frame"] = estimate.frame.robot
        chains |= {k: solved.chain for k, solved in estimate.trajectories.items()}
        team = _problem(robot, estimate)
        out |= _tables(team, robot) if team else {}
        out["modules"] = point_report.modules(robot)
    out["clocks"] = {
        str(k): clock_report.clock(robot, chain, utime) for k, chain in sorted(chains.items())
    }
    return out


def _problem(robot: Robot, estimate: TeamEstimate) -> TeamProblem | None:
    """What module 3 saw last, its poses as they are known; None when what joined the group was
    withdrawn since."""
    held = PoseGraph.of(robot.back.looked_at)
    connected = [group for group in team_frame.groups(held) if estimate.frame in group]
    members, points = standing_points.with_points(
        estimate.frame, connected[0] if connected else set(), held
    )
    if estimate.frame not in members:
        return None
    members, mirrored = mirror_images.with_mirrored(estimate.frame, members, held)
    group = Group(members, estimate.frame, points, mirrored)
    return build_problem(held, group, estimate, settings.banded_optimizer(robot.config))


def _tables(team: TeamProblem, robot: Robot) -> dict[str, Any]:
    problem, places = team.problem, team.places
    poses = problem.initial
    names = np.array([chain.robot for chain in team.chains])
    times = problem.n * GRID_US
    names_and_times = [np.arange(len(poses)), problem.robot_id, times]
    angles = se2.wrap(poses[:, 2])
    wheels = _odometry(team, robot)
    ranges, pairs = problem.ranges, np.array(team.pairs).reshape(-1, 2)
    error = range_errors(poses, ranges, team.start, problem.model).error
    bias = team.start.bias[ranges.pair] if len(pairs) else np.zeros(0)
    told = [names[ranges.robots], ranges.i, ranges.j, ranges.measured, ranges.sigma, bias, error]
    edges = problem.odometry
    is_robot = problem.robot_id < FIRST_NODE
    to_robots = is_robot[ranges.i] & is_robot[ranges.j]
    closures = factors.closures(PoseGraph.of(robot.back.looked_at), places)
    closures = closures.chosen(is_robot[closures.i] & is_robot[closures.j])
    odometry = BetweenFactors(edges.i, edges.j, corrected(edges, team.start), edges.covariance)
    return {
        "keyframes": _table(
            KEYFRAME_COLUMNS,
            np.column_stack([*names_and_times, poses[:, :2], angles, wheels])[is_robot],
        ),
        "odometry": _table(EDGE_COLUMNS, _edges(odometry)),
        "closures": _table(EDGE_COLUMNS, _edges(closures)),
        "ranges": _table(
            ("a", "b", "i", "j", "range_m", "sigma_m", "bias_m", "residual_m"),
            _by_time(np.column_stack(told)[to_robots], 2),
        ),
        "module_ranges": _table(
            ("robot", "module", "i", "range_m", "sigma_m", "bias_m", "residual_m"),
            _to_modules(np.column_stack(told)[~to_robots]),
        ),
    }


def _to_modules(told: Array) -> Array:
    """Rows of ranges to modules that no robot carries, which measure nothing themselves."""
    rows = np.column_stack([told[:, 0], told[:, 1] - FIRST_NODE, told[:, 2], told[:, 4:]])
    return np.asarray(rows[np.argsort(rows[:, 2], kind="stable")])


def _odometry(team: TeamProblem, robot: Robot) -> Array:
    """(k, 3) o_T_k of the keyframes."""
    out = np.zeros_like(team.problem.initial)
    for chain in team.chains:
        place = team.places.place[chain.robot]
        keyframes = robot.back.looked_at.chains[chain.robot].keyframes
        out[place[place >= 0]] = keyframes.poses[place >= 0]
    out[:, 2] = se2.wrap(out[:, 2])
    return out


def _edges(between: BetweenFactors) -> Array:
    covariance = between.covariance
    packed = covariance[:, [0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]]
    return _by_time(np.column_stack([between.i, between.j, between.measured, packed]), 0)


def _by_time(rows: Array, column: int) -> Array:
    """In the order of the later of two keyframes, which are numbered by time."""
    later = rows[:, column : column + 2].max(axis=1, initial=0)
    return np.asarray(rows[np.argsort(later, kind="stable")])


def _table(columns: tuple[str, ...], rows: Array) -> dict[str, Any]:
    """Whole numbers stay whole; covariances keep their digits."""
    newest = rows[-MOST_ROWS:]
    out = []
    for name, values in zip(columns, newest.T, strict=True):
        is_whole = "_" not in name
        is_square = name.endswith(("2", "_m_rad"))
        if is_whole:
            out.append(values.astype(np.int64).tolist())
        else:
            out.append(_significant(values) if is_square else _rounded(values))
    return {
        "columns": list(columns),
        "rows": [list(row) for row in zip(*out, strict=True)],
        "left_out": len(rows) - len(newest),
    }


def _rounded(values: Array) -> list[float]:
    found: list[float] = np.round(values, DIGITS).tolist()
    return found


def _significant(values: Array) -> list[float]:
    """Seven digits of each."""
    size = 10.0 ** np.floor(np.log10(np.maximum(np.abs(values), SMALLEST)))
    found: list[float] = (np.round(values / size, DIGITS) * size).tolist()
    return found


def _published(robot: Robot) -> dict[str, Any]:
    """Everybody's poses of late, as they were published, on their own clocks."""
    said = {k: peer.poses for k, peer in robot.team.peers.items()}
    said[robot.own.robot] = robot.broadcast.poses
    return {str(k): _table(pose_history.COLUMNS, poses.rows()) for k, poses in sorted(said.items())}
