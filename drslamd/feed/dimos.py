"""Messages of the package dimos-lcm, over LCM: ROS's nouns in LCM's encoding.

A channel is named as dimos names it: topic, ``#``, type.
"""

from __future__ import annotations

import importlib
from typing import Any

from drslamd.feed.ros_messages import ros_messages
from drslamd.near.near_message import Near

OTHER_NAMES = {"nanosec": "nsec"}
"""Fields that are named as in ROS 1 there."""


class Dimos:
    """Publishes what one robot tells."""

    def __init__(self, robot: int, url: str) -> None:
        """
        Raises:
            RuntimeError: there is no LCM at this URL.
        """
        import lcm

        self._robot, self._lcm = robot, lcm.LCM(url)

    def tell(self, near: Near) -> None:
        """Publish every message on its channel."""
        for topic, kind, message in ros_messages(self._robot, near):
            self._lcm.publish(f"{topic}#{kind.replace('/', '.')}", encoded(kind, message))

    def close(self) -> None:
        """Nothing is left open."""


def encoded(kind: str, message: Any) -> bytes:
    """LCM bytes of a message of ROS."""
    out = _type(kind)()
    _fill(out, message)
    return bytes(out.lcm_encode())


def _type(kind: str) -> Any:
    package, name = kind.split("/")
    return getattr(importlib.import_module(f"dimos_lcm.{package}"), name)


def _fill(out: Any, message: Any) -> None:
    for field, value in message.items():
        name = OTHER_NAMES.get(field, field)
        if isinstance(value, dict):
            # one of its own: those that it is born with are shared by all messages
            part = type(getattr(out, name))()
            _fill(part, value)
            setattr(out, name, part)
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            setattr(out, f"{name}_length", len(value))
            setattr(out, name, [_transform(each) for each in value])
        else:
            setattr(out, name, value)


def _transform(message: Any) -> Any:
    """The only message of which there are lists."""
    out = _type("geometry_msgs/TransformStamped")()
    _fill(out, message)
    return out
