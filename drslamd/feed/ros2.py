"""tf and odometry for ROS 2: over DDS, or into a file. Neither needs an installed ROS.

Over DDS a topic ``/tf`` is ``rt/tf`` and a type ``tf2_msgs::msg::dds_::TFMessage_``; with that any
node in the same domain sees it.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from drslamd.export.ros2.cdr import serialised
from drslamd.export.ros2.definitions import TYPES, schema_name, schema_text
from drslamd.feed.ros_messages import ros_messages
from drslamd.feed.stream import unix_us
from drslamd.near.near_message import Near


class Dds:
    """Publishes to one DDS domain."""

    def __init__(self, robot: int, domain: int) -> None:
        from cyclonedds.domain import DomainParticipant

        self._robot, self._participant = robot, DomainParticipant(domain)
        self._writers: dict[str, Any] = {}

    def tell(self, near: Near) -> None:
        """Write every message to its topic."""
        for topic, kind, message in ros_messages(self._robot, near):
            if topic not in self._writers:
                self._writers[topic] = _writer(self._participant, topic, kind)
            self._writers[topic].write(_filled(kind, message))

    def close(self) -> None:
        self._writers.clear()


def _writer(participant: Any, topic: str, kind: str) -> Any:
    from cyclonedds.core import Policy, Qos
    from cyclonedds.pub import DataWriter
    from cyclonedds.topic import Topic
    from cyclonedds.util import duration

    reliable = Policy.Reliability.Reliable(duration(milliseconds=1))
    qos = Qos(reliable, Policy.History.KeepLast(10), Policy.Durability.Volatile)
    return DataWriter(participant, Topic(participant, f"rt{topic}", dds_type(kind), qos=qos), qos)


@cache
def dds_type(kind: str) -> Any:
    """The type of DDS that ROS 2 gives to one of its own."""
    from cyclonedds.idl import make_idl_struct
    from cyclonedds.idl import types as idl_types

    types: Any = idl_types

    def of(name: str) -> Any:
        inner, is_list, length = name.partition("[")
        one = {"string": str}.get(inner) or getattr(types, inner, None) or dds_type(inner)
        if not is_list:
            return one
        size = length.rstrip("]")
        return types.array[one, int(size)] if size else types.sequence[one]

    package, name = kind.split("/")
    fields = {field: of(inner) for inner, field in TYPES[kind]}
    return make_idl_struct(f"{name}_", f"{package}::msg::dds_::{name}_", fields)


def _filled(kind: str, message: Any) -> Any:
    values = {}
    for name, field in TYPES[kind]:
        inner, is_list, _ = name.partition("[")
        value = message[field]
        if inner in TYPES:
            value = [_filled(inner, v) for v in value] if is_list else _filled(inner, value)
        values[field] = value
    return dds_type(kind)(**values)


class Mcap:
    """Writes an MCAP file in the ROS 2 profile, until it is closed."""

    def __init__(self, robot: int, path: Path) -> None:
        """
        Raises:
            OSError: the file cannot be made.
        """
        from mcap.writer import Writer

        self._robot = robot
        self._file = path.open("wb")
        self._writer: Any = Writer(self._file)
        self._writer.start(profile="ros2", library="drslamd")
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}

    def tell(self, near: Near) -> None:
        """Append every message."""
        ns = max(0, 1_000 * unix_us(near, near.utime))
        for topic, kind, message in ros_messages(self._robot, near):
            if kind not in self._schemas:
                text = schema_text(kind).encode()
                self._schemas[kind] = self._writer.register_schema(
                    schema_name(kind), "ros2msg", text
                )
            if topic not in self._channels:
                self._channels[topic] = self._writer.register_channel(
                    topic, "cdr", self._schemas[kind]
                )
            data = serialised(kind, message)
            self._writer.add_message(self._channels[topic], log_time=ns, publish_time=ns, data=data)

    def close(self) -> None:
        """Without this the file has no end, and most readers refuse it."""
        self._writer.finish()
        self._file.close()
