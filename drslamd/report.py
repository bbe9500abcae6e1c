"""What a robot says of itself when it is asked: plain dictionaries, ready for JSON.

Every age is in seconds, every silent stage has its reasons counted.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drslamd.conventions import GRID_US, SECOND_US, is_node
from drslamd.events import PortCondition
from drslamd.gossip.message_types import PoseState
from drslamd.gossip.peer import Peer
from drslamd.reports import clock_report, hypothesis_report, point_report
from drslamd.robot import Robot
from drslamd.sensors.gyro.gyro_heading import GyroHeading
from drslamd.slam.consistency.pair import PairTracker
from drslamd.slam.graph.trajectory import deform_track


def age_s(utime: int, then: int | None) -> float | None:
    return None if then is None else round((utime - then) / SECOND_US, 3)


def status(robot: Robot, utime: int) -> dict[str, Any]:
    """The whole picture: problems first, then sensors, peers, pairs, graph and pose."""
    return {
        "robot": robot.own.robot,
        "epoch": robot.own.epoch,
        "insecure": robot.config.team.insecure,
        "problems": list(robot.health.sentences().values()),
        "conditions": _conditions(robot, utime),
        "pose": _pose(robot, utime),
        "uwb": _uwb(robot, utime),
        "wheels": _wheels(robot, utime),
        "network": _network(robot, utime),
        "peers": _peers(robot, utime),
        "pairs": {str(k): _pair(pair) for k, pair in sorted(robot.front.pairs.items())},
        "hypotheses": _hypotheses(robot, utime),
        "points": point_report.points(robot),
        "site": point_report.site(robot, utime),
        "graph": _graph(robot),
    }


def _conditions(robot: Robot, utime: int) -> list[dict[str, Any]]:
    """The problems again, with their keys and since when they hold; causes first."""
    ages = robot.health.ages_us(utime)
    return [
        {"key": key, "what": sentence, "since_s": ages[key] // SECOND_US}
        for key, sentence in robot.health.sentences().items()
    ]


def _pose(robot: Robot, utime: int) -> dict[str, Any]:
    estimate, where = robot.back.estimate, robot.whereabouts(utime)
    if estimate is None or where.pose is None:
        return {"state": state_name(where.state)}
    _, pose, covariance = where.pose
    spread = np.linalg.eigvalsh(covariance[:2, :2])[-1]
    is_known = where.state is not PoseState.POSITION
    sigma_deg = math.degrees(math.sqrt(float(covariance[2, 2])))
    return {
        "state": state_name(where.state),
        "frame": estimate.frame.robot,
        "age_s": round(where.age_us / SECOND_US, 3),
        "x_m": round(float(pose[0]), 4),
        "y_m": round(float(pose[1]), 4),
        "theta_deg": round(math.degrees(float(pose[2])), 3) if is_known else None,
        "sigma_m": round(math.sqrt(float(spread)), 4),
        "sigma_deg": round(sigma_deg, 3) if is_known else None,
    }


def _hypotheses(robot: Robot, utime: int) -> list[dict[str, Any]]:
    said = robot.broadcast.make_hypotheses(robot.neighbours(utime), utime)
    return hypothesis_report.rows(said, robot.own.robot, utime)


def state_name(state: PoseState) -> str:
    """Its word: localised, doubtful, stale, not localised."""
    return state.name.lower().replace("_", " ")


def _port(robot: Robot, name: str) -> dict[str, Any]:
    state = robot.ports.get(name)
    if state is None:
        return {"port": "not tried yet"}
    detail = "" if state.condition is PortCondition.OPEN else state.detail
    return {"port": state.condition.value, "detail": detail}


def _uwb(robot: Robot, utime: int) -> dict[str, Any]:
    fresh = {
        str(uwb_id): {
            "robot": robot.team.robot_of_uwb(uwb_id),
            "count": buffer.count,
            "age_s": age_s(utime, buffer.newest),
        }
        for uwb_id, buffer in sorted(robot.front.ranges.items())
    }
    return {
        **_port(robot, "uwb"),
        "age_s": age_s(utime, robot.uwb.last_good_utime),
        "voltage_v": robot.uwb.voltage_v,
        "foreign_id": robot.uwb.foreign_id,
        "counters": robot.uwb.counters(),
        "ranges": fresh,
    }


def _wheels(robot: Robot, utime: int) -> dict[str, Any]:
    return {
        **_port(robot, "wheels"),
        "age_s": age_s(utime, robot.wheels.last_motion_utime),
        "path_m": round(robot.front.reckoning.path_m, 3),
        "counters": robot.wheels.counters(),
        **({"gyro": _gyro(robot.wheels.gyro, utime)} if robot.wheels.gyro.is_there else {}),
    }


def _gyro(gyro: GyroHeading, utime: int) -> dict[str, Any]:
    """Does it give the heading, and what is known of it?"""
    fault, rest, known = gyro.fault(utime), gyro.rest, gyro.comparison.known
    return {
        "in_use": gyro.is_in_use,
        "fault": fault.value if fault else None,
        "bias_deg_per_s": round(math.degrees(rest.bias_radps), 4),
        "bias_sigma_deg_per_h": round(math.degrees(rest.told.yaw_rad_per_s) * 3600, 1),
        "turns_of_wheels": round(known.ratio, 3),
        "slips_s": gyro.comparison.slips,
    }


def _network(robot: Robot, utime: int) -> dict[str, Any]:
    team, state = robot.team, robot.network
    return {
        "up": bool(state and state.up),
        "detail": state.detail if state else "not tried yet",
        "messages_sent": robot.outbox.messages_sent,
        "bytes_sent": robot.outbox.bytes_sent,
        "held_back": dict(robot.outbox.held_back),
        "accepted": team.accepted,
        "own_echoes": team.own_echoes,
        "log_entries_heard_again": team.repeats_heard,
        "refused": dict(team.refused),
        "own_echo_age_s": age_s(utime, team.last_echo),
        "log_entries_repeated": team.logs.repeats.repeated,
        "unsayable": team.unsayable,
    }


def _peers(robot: Robot, utime: int) -> dict[str, Any]:
    own_hash, peers = robot.back.said_digest(), sorted(robot.team.everybody.items())
    return {str(k): _peer(robot, peer, utime, own_hash) for k, peer in peers}


def _peer(robot: Robot, peer: Peer, utime: int, own_hash: int) -> dict[str, Any]:
    offset = peer.clock.offset(utime)
    return {
        "epoch": peer.chain.epoch,
        "alive": peer.is_alive(utime),
        "hears_us": peer.hears(robot.own),
        "age_s": age_s(utime, peer.last_heard),
        "received": peer.received,
        "loss": round(peer.loss, 3),
        "clock_offset_ms": None if offset is None else round(offset.us / 1e3, 3),
        "clock_uncertainty_ms": None if offset is None else round(offset.uncertainty_us / 1e3, 3),
        "clock_source": None if offset is None else offset.source,
        "uwb_id": peer.status.uwb_id if peer.status else None,
        "pose": state_name(peer.status.state) if peer.status else None,
        "localised": bool(peer.status and peer.status.state),
        "frame": peer.status.frame if peer.status and peer.status.state else None,
        "same_graph": bool(peer.status and peer.status.graph_hash == own_hash),
        "log_entries_lacking": robot.team.logs.lacking(peer.chain.robot),
    }


def _pair(pair: PairTracker) -> dict[str, Any]:
    return {
        "connected": pair.connected,
        "windows": dict(pair.verdicts),
        "closures_seen": pair.closures_seen,
        "closures_kept": len(pair.kept),
    }


def _graph(robot: Robot) -> dict[str, Any]:
    estimate, learned, own = robot.back.estimate, robot.calibration.latest, robot.own.robot
    out: dict[str, Any] = {
        "group": sorted({s.robot for s in robot.back.group if not is_node(s.robot)}),
        "keyframes": {
            str(k): len(c.keyframes)
            for k, c in robot.back.looked_at.chains.items()
            if not is_node(k)
        },
        "modules": point_report.modules(robot),
    }
    if estimate is not None:
        out |= {
            "frame": estimate.frame.robot,
            "iterations": estimate.iterations,
            "converged": estimate.converged,
            "range_bias_m": {
                f"{min(own, peer)}-{max(own, peer)}": round(bias.value, 4)
                for peer, bias in learned.bias.items()
            },
            "near_range_bias_m": round(estimate.near_bias_m.value, 4),
            "wheel_scale": {str(own): round(learned.scale.value, 5)},
            "wheel_turn": {str(own): round(learned.turn.value, 5)},
            "antenna_m": {
                str(own): [round(learned.antenna_x.value, 4), round(learned.antenna_y.value, 4)]
            },
        }
    return out


def trajectories(robot: Robot, utime: int) -> dict[str, Any]:
    """Everybody's path in the frame of the team: ours at 10 Hz, the others' keyframes.

    Times are microseconds on the clock of the robot that drove the path; beside them is how far
    that was from ours (`reports.clock_report.clock`).
    """
    estimate = robot.back.estimate
    if estimate is None:
        return {"frame": None, "robots": {}, "modules": {}, "site": None}
    out = {}
    for number, solved in sorted(estimate.trajectories.items()):
        n, poses = solved.n, solved.poses
        if number == robot.own.robot:
            n, poses = deform_track(
                robot.front.reckoning.track, robot.back.history.latest or solved
            )
        out[str(number)] = {
            "epoch": solved.chain.epoch,
            "utime": (n * GRID_US).astype(np.int64).tolist(),
            "poses": np.round(poses, 6).tolist(),
            "has_heading": number not in estimate.points,
            "clock": clock_report.clock(robot, solved.chain, utime),
        }
    modules = point_report.modules(robot)
    site = point_report.site(robot, utime)
    return {"frame": estimate.frame.robot, "robots": out, "modules": modules, "site": site}


def closures(robot: Robot) -> dict[str, Any]:
    """What module 1 answered and what module 2 made of it, window by window."""
    out = []
    for peer, pair in sorted(robot.front.pairs.items()):
        kept = pair.accepted()
        for answer in pair.history:
            poses = [h.a_T_b.tolist() for h in answer.estimate.hypotheses]
            out.append(
                {
                    "a": robot.own.robot,
                    "b": peer,
                    "utime": answer.utime,
                    "verdict": answer.estimate.verdict.value,
                    "poses": poses,
                    "covariances": [h.covariance.tolist() for h in answer.estimate.hypotheses],
                    "kept": bool(poses) and answer.number in kept,
                }
            )
    return {"closures": out}
