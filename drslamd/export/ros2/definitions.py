"""The message types of ROS 2 that are written, field by field.

Only the order, the names and the types of fields matter: they are the interface. The text that a
file carries as its schema is made from the same lists as the bytes (`cdr`), so that both agree.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

Fields = tuple[tuple[str, str], ...]
"""(type, name); `T[]` is a sequence, `T[n]` an array."""

TYPES: Mapping[str, Fields] = MappingProxyType(
    {
        "builtin_interfaces/Time": (("int32", "sec"), ("uint32", "nanosec")),
        "std_msgs/Header": (("builtin_interfaces/Time", "stamp"), ("string", "frame_id")),
        "geometry_msgs/Point": (("float64", "x"), ("float64", "y"), ("float64", "z")),
        "geometry_msgs/Vector3": (("float64", "x"), ("float64", "y"), ("float64", "z")),
        "geometry_msgs/Quaternion": (
            *(("float64", "x"), ("float64", "y")),
            *(("float64", "z"), ("float64", "w")),
        ),
        "geometry_msgs/Pose": (
            ("geometry_msgs/Point", "position"),
            ("geometry_msgs/Quaternion", "orientation"),
        ),
        "geometry_msgs/PoseStamped": (
            ("std_msgs/Header", "header"),
            ("geometry_msgs/Pose", "pose"),
        ),
        "geometry_msgs/PoseWithCovariance": (
            ("geometry_msgs/Pose", "pose"),
            ("float64[36]", "covariance"),
        ),
        "geometry_msgs/PoseWithCovarianceStamped": (
            ("std_msgs/Header", "header"),
            ("geometry_msgs/PoseWithCovariance", "pose"),
        ),
        "geometry_msgs/Transform": (
            ("geometry_msgs/Vector3", "translation"),
            ("geometry_msgs/Quaternion", "rotation"),
        ),
        "geometry_msgs/TransformStamped": (
            ("std_msgs/Header", "header"),
            ("string", "child_frame_id"),
            ("geometry_msgs/Transform", "transform"),
        ),
        "geometry_msgs/Twist": (
            ("geometry_msgs/Vector3", "linear"),
            ("geometry_msgs/Vector3", "angular"),
        ),
        "geometry_msgs/TwistWithCovariance": (
            ("geometry_msgs/Twist", "twist"),
            ("float64[36]", "covariance"),
        ),
        "tf2_msgs/TFMessage": (("geometry_msgs/TransformStamped[]", "transforms"),),
        "nav_msgs/Odometry": (
            ("std_msgs/Header", "header"),
            ("string", "child_frame_id"),
            ("geometry_msgs/PoseWithCovariance", "pose"),
            ("geometry_msgs/TwistWithCovariance", "twist"),
        ),
        "nav_msgs/Path": (
            ("std_msgs/Header", "header"),
            ("geometry_msgs/PoseStamped[]", "poses"),
        ),
        "diagnostic_msgs/KeyValue": (("string", "key"), ("string", "value")),
        "diagnostic_msgs/DiagnosticStatus": (
            *(("byte", "level"), ("string", "name"), ("string", "message")),
            *(("string", "hardware_id"), ("diagnostic_msgs/KeyValue[]", "values")),
        ),
        "diagnostic_msgs/DiagnosticArray": (
            ("std_msgs/Header", "header"),
            ("diagnostic_msgs/DiagnosticStatus[]", "status"),
        ),
    }
)

RULE = "=" * 80
"""Between the types of one schema."""


def schema_name(name: str) -> str:
    """As files name a type: ``package/msg/Type``."""
    package, _, short = name.partition("/")
    return f"{package}/msg/{short}"


def schema_text(name: str) -> str:
    """The definition of a type and of all that it is made of."""
    parts, waiting, seen = [], [name], {name}
    while waiting:
        current = waiting.pop(0)
        text = "".join(f"{kind} {field}\n" for kind, field in TYPES[current])
        parts.append(text if current == name else f"MSG: {current}\n{text}")
        for kind, _ in TYPES[current]:
            inner = kind.partition("[")[0]
            if inner in TYPES and inner not in seen:
                seen.add(inner)
                waiting.append(inner)
    return f"{RULE}\n".join(parts)
