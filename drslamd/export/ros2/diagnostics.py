"""The status of a daemon as diagnostics of ROS 2."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from drslamd.export.ros2.nouns import Message, header

OK, WARN, ERROR, STALE = 0, 1, 2, 3
LEVELS = {
    "localised": OK,
    "position": WARN,
    "doubtful": WARN,
    "stale": STALE,
    "not localised": ERROR,
}


def diagnostics(status: Mapping[str, Any], unix_us: int) -> Message:
    """The robot that was asked, with its problems; and each peer as it sees it."""
    own, state = status["robot"], status["pose"]["state"]
    level = LEVELS[state] or (WARN if status["problems"] else OK)
    said = "; ".join(status["problems"]) or state
    pose = {key: value for key, value in status["pose"].items() if key != "state"}
    about = [_entry(own, level, said, {"state": state, **pose})]
    for robot, peer in status["peers"].items():
        alive = bool(peer["alive"])
        word = peer["pose"] or "not heard yet"
        level = LEVELS.get(word, STALE) if alive else STALE
        about.append(_entry(robot, level, word if alive else "silent", peer))
    return {"header": header(unix_us, ""), "status": about}


def _entry(robot: int | str, level: int, said: str, values: Mapping[str, Any]) -> Message:
    pairs = [{"key": key, "value": "" if v is None else str(v)} for key, v in values.items()]
    return {
        "level": level,
        "name": f"drslamd: robot {robot}",
        "message": said,
        "hardware_id": f"robot_{robot}",
        "values": pairs,
    }
