"""Ranges, closures, verdicts, keyframes and published poses as CSV; each column names its unit.

Times are UNIX seconds; where a robot's clock is not known its cells are empty.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from drslamd.export import stamps
from drslamd.export.answers import keyframe_times, seconds
from drslamd.export.files import replaced

STATES = ("not localised", "localised", "doubtful", "stale", "position")
"""Words of `PoseState`."""
POSE_ROW = ("x_m", "y_m", "theta_rad")
COVARIANCE_ROW = ("xx_m2", "xy_m2", "xt_m_rad", "yy_m2", "yt_m_rad", "tt_rad2")


def write(folder: Path, answer: Mapping[str, Any]) -> list[Path]:
    """One file for each table of an answer to ``graph``; a robot in no group has only windows and
    poses.

    Raises:
        OSError: the folder or a file cannot be made.
    """
    folder.mkdir(parents=True, exist_ok=True)
    timed = [name for name in ("odometry", "closures", "ranges") if name in answer]
    timed += ["module_ranges"] if answer.get("modules") else []
    tables = {f"{name}.csv": _timed(answer, name) for name in timed}
    tables |= {"keyframes.csv": keyframe_rows(answer)} if "keyframes" in answer else {}
    tables |= {
        "windows.csv": _text(
            ("t_unix_s", "a", "b", "verdict", "kept", "hypothesis", *POSE_ROW, *COVARIANCE_ROW),
            _windows(answer),
        ),
        "poses.csv": _text(
            ("t_unix_s", "robot", "state", "frame", *POSE_ROW, *COVARIANCE_ROW), _poses(answer)
        ),
    }
    if answer.get("modules"):
        tables["modules.csv"] = _text(
            ("module", "x_m", "y_m", "xx_m2", "xy_m2", "yy_m2"),
            (
                [k, m["x_m"], m["y_m"], *m["covariance_m2"]]
                for k, m in sorted(answer["modules"].items(), key=lambda item: int(item[0]))
            ),
        )
    for name, text in tables.items():
        replaced(folder / name, text)
    return [folder / name for name in tables]


def keyframe_rows(answer: Mapping[str, Any]) -> str:
    """The keyframes, with their UNIX time in the place of that of their robot."""
    told, at = answer["keyframes"], keyframe_times(answer)
    names = ["t_unix_s" if name == "utime" else name for name in told["columns"]]
    rows = ([row[0], row[1], _time(at, row[0]), *row[3:]] for row in told["rows"])
    return _text(names, rows)


def _timed(answer: Mapping[str, Any], table: str) -> str:
    """A table with the time of its keyframe i before it."""
    told, at = answer[table], keyframe_times(answer)
    i = told["columns"].index("i")
    return _text(["t_unix_s", *told["columns"]], ([_time(at, r[i]), *r] for r in told["rows"]))


def _windows(answer: Mapping[str, Any]) -> Iterator[Sequence[Any]]:
    """A row for each pose that a window allows; one without a pose where it allows none."""
    windows = answer["windows"]
    times = _unix(answer, answer["robot"], [w["utime"] for w in windows])
    for t, w in zip(times, windows, strict=True):
        about = [t, w["a"], w["b"], w["verdict"], int(w["kept"])]
        if not w["poses"]:
            yield [*about, "", *[""] * 9]
        for k, (pose, c) in enumerate(zip(w["poses"], w["covariances"], strict=True)):
            yield [*about, k, *pose, c[0][0], c[0][1], c[0][2], c[1][1], c[1][2], c[2][2]]


def _poses(answer: Mapping[str, Any]) -> Iterator[Sequence[Any]]:
    for robot, table in answer["poses"].items():
        times = _unix(answer, robot, [row[0] for row in table["rows"]])
        for t, (_, state, frame, *numbers) in zip(times, table["rows"], strict=True):
            yield [t, robot, STATES[state], frame, *numbers]


def _unix(answer: Mapping[str, Any], robot: int | str, utime: list[int]) -> list[str]:
    known = stamps.unix_stamps(utime, answer["clocks"][str(robot)], answer["wall"])
    return [""] * len(utime) if known is None else [seconds(t) for t in known.unix_us.tolist()]


def _time(at: Mapping[int, int], key: int) -> str:
    return seconds(at[key]) if key in at else ""


def _text(names: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    out = io.StringIO()
    table = csv.writer(out, lineterminator="\n")
    table.writerow(names)
    table.writerows(rows)
    return out.getvalue()
