"""``team.mcap``: what a robot knows of the team, in the ROS 2 profile of MCAP.

Frames follow REP 105 for each robot: ``team_of_F`` (the odometry frame of robot F, in which the
team lives), ``robot_N/odom``, ``robot_N/base_link``. Topics: ``/tf`` and ``/robot_N/odometry`` at
the solved keyframes, ``/robot_N/pose`` as it was published, with covariance, in the frame that it
was published in, ``/robot_N/path`` as it is known now, ``/diagnostics`` of now. m, rad, UNIX time.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import Writer

from drslamd import __version__
from drslamd.export import stamps
from drslamd.export.answers import columns, keyframe_times
from drslamd.export.files import replaced
from drslamd.export.ros2 import nouns
from drslamd.export.ros2.cdr import serialised
from drslamd.export.ros2.definitions import schema_name, schema_text
from drslamd.export.ros2.diagnostics import diagnostics
from drslamd.slam import se2

Said = tuple[int, str, str, Mapping[str, Any]]
"""UNIX time us, topic, type, message."""


def write(folder: Path, answers: Mapping[str, Any]) -> list[Path]:
    """The file, out of answers to ``graph``, ``trajectory`` and ``status``.

    Raises:
        OSError: the folder or the file cannot be made.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "team.mcap"
    replaced(path, _bytes(answers))
    return [path]


def _bytes(answers: Mapping[str, Any]) -> bytes:
    graph, out = answers["graph"], io.BytesIO()
    now = graph["utime"] + graph["wall"]["utc_minus_clock_us"]
    said = [
        *_keyframes(graph),
        *_published(graph),
        *_paths(answers["trajectory"]),
        (
            now,
            "/diagnostics",
            "diagnostic_msgs/DiagnosticArray",
            diagnostics(answers["status"], now),
        ),
    ]
    file = Writer(out)
    file.start(profile="ros2", library=f"drslamd {__version__}")
    schemas: dict[str, int] = {}
    channels: dict[str, int] = {}
    for unix_us, topic, kind, message in sorted(said, key=lambda one: one[:2]):
        if kind not in schemas:
            text = schema_text(kind).encode()
            schemas[kind] = file.register_schema(schema_name(kind), "ros2msg", text)
        if topic not in channels:
            channels[topic] = file.register_channel(topic, "cdr", schemas[kind])
        ns = 1_000 * unix_us
        file.add_message(
            channels[topic], log_time=ns, publish_time=ns, data=serialised(kind, message)
        )
    file.add_metadata("drslamd", _about(graph))
    file.finish()  # type: ignore[no-untyped-call]
    return out.getvalue()


def _about(graph: Mapping[str, Any]) -> dict[str, str]:
    """How wrong the stamps are, and in whose frame the team is."""
    wall, out = graph["wall"], {"asked_robot": str(graph["robot"]), "units": "m, rad, s"}
    out["frame"] = "none" if graph["frame"] is None else f"team_of_{graph['frame']}"
    for robot, clock in graph["clocks"].items():
        times = [reading[0] + reading[1] for reading in clock["readings"]]
        known = stamps.unix_stamps(times, clock, wall)
        if known is not None:
            out[f"stamps_of_robot_{robot}"] = stamps.sentences(robot, clock, known, wall)
    return out


def _keyframes(graph: Mapping[str, Any]) -> Iterator[Said]:
    table, at = columns(graph, "keyframes"), keyframe_times(graph)
    for robot in np.unique(table["robot"]).astype(int).tolist() if table else ():
        mine = table["robot"] == robot
        keys = table["key"][mine].astype(int).tolist()
        w_T_k = np.stack([table[c][mine] for c in ("x_m", "y_m", "theta_rad")], axis=-1)
        names = ("odometry_x_m", "odometry_y_m", "odometry_theta_rad")
        o_T_k = np.stack([table[c][mine] for c in names], axis=-1)
        w_T_o = se2.compose(w_T_k, se2.inverse(o_T_k))
        odom, base = f"robot_{robot}/odom", f"robot_{robot}/base_link"
        step = se2.between(o_T_k[:-1], o_T_k[1:])
        step = np.concatenate([np.zeros((1, 3)), step])
        seconds = np.diff([at[key] for key in keys if key in at], prepend=0) / 1e6
        for k, key in enumerate(keys if keys[0] in at else ()):
            t, took = at[key], seconds[k]
            frames = [
                nouns.transform(t, f"team_of_{graph['frame']}", odom, w_T_o[k]),
                nouns.transform(t, odom, base, o_T_k[k]),
            ]
            yield t, "/tf", "tf2_msgs/TFMessage", {"transforms": frames}
            turn = float(se2.wrap(step[k, 2]))
            speeds = (step[k, 0] / took, turn / took) if k else (0.0, 0.0)
            message = nouns.odometry(t, odom, base, o_T_k[k], *speeds)
            yield t, f"/robot_{robot}/odometry", "nav_msgs/Odometry", message


def _published(graph: Mapping[str, Any]) -> Iterator[Said]:
    kind = "geometry_msgs/PoseWithCovarianceStamped"
    for robot, table in graph["poses"].items():
        utime = [row[0] for row in table["rows"]]
        known = stamps.unix_stamps(utime, graph["clocks"][robot], graph["wall"])
        if known is None:
            continue
        for t, row in zip(known.unix_us.tolist(), table["rows"], strict=True):
            body = {"pose": nouns.pose(row[3:6]), "covariance": nouns.covariance(row[6:])}
            head = nouns.header(t, f"team_of_{row[2]}")
            yield t, f"/robot_{robot}/pose", kind, {"header": head, "pose": body}


def _paths(trajectory: Mapping[str, Any]) -> Iterator[Said]:
    frame = f"team_of_{trajectory['frame']}"
    for robot, path in trajectory["robots"].items():
        known = stamps.unix_stamps(path["utime"], path["clock"], trajectory["wall"])
        if known is None or not len(known.unix_us):
            continue
        times = known.unix_us.tolist()
        poses = [
            {"header": nouns.header(t, frame), "pose": nouns.pose(pose)}
            for t, pose in zip(times, path["poses"], strict=True)
        ]
        head = nouns.header(times[-1], frame)
        yield times[-1], f"/robot_{robot}/path", "nav_msgs/Path", {"header": head, "poses": poses}
