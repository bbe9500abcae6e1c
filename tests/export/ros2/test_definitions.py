"""Definitions of ROS 2 types, held against those that rosbags ships."""

from __future__ import annotations

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from drslamd.export.ros2.definitions import TYPES, schema_name, schema_text

THEIRS = get_typestore(Stores.ROS2_HUMBLE)
WRITTEN = (
    "geometry_msgs/PoseWithCovarianceStamped",
    "tf2_msgs/TFMessage",
    "nav_msgs/Odometry",
    "nav_msgs/Path",
    "diagnostic_msgs/DiagnosticArray",
)


@pytest.mark.parametrize("name", list(TYPES))
def test_a_type_has_the_fields_that_ros_gives_it(name: str) -> None:
    ours = get_types_from_msg(schema_text(name), schema_name(name))
    for full, (_, fields) in ours.items():
        assert fields == THEIRS.fielddefs[full][1], full


@pytest.mark.parametrize("name", WRITTEN)
def test_a_schema_names_each_type_that_it_is_made_of_once(name: str) -> None:
    text = schema_text(name)
    named = [line[5:] for line in text.splitlines() if line.startswith("MSG: ")]
    assert len(named) == len(set(named)) > 0
    needed, waiting = set(), [name]
    while waiting:
        for kind, _ in TYPES[waiting.pop()]:
            inner = kind.partition("[")[0]
            if inner in TYPES:
                needed.add(inner)
                waiting.append(inner)
    assert set(named) == needed


def test_a_type_is_named_as_files_name_it() -> None:
    assert schema_name("nav_msgs/Path") == "nav_msgs/msg/Path"
