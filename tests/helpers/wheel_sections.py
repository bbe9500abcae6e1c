"""A section ``[wheels]`` of every base."""

from __future__ import annotations

from typing import Any

from drslamd.config_wheels import SOURCES, WheelSection

SECTIONS: dict[str, dict[str, Any]] = {
    "kobuki": {"port": "/p"},
    "roboteq": {"port": "/p", "track_m": 0.5, "counts_per_metre": 2000.0},
    "ascii": {"port": "/p", "track_m": 0.5, "counts_per_metre": 100.0},
    "wheeltec": {"port": "/p", "track_m": 0.3},
    "odrive": {"left_axis": 3, "right_axis": 5, "track_m": 0.5, "wheel_radius_m": 0.1},
    "agilex": {"track_m": 0.6},
}
DBC = {"dbc_file": "f", "track_m": 0.5, "left": "A.B", "right": "A.C"}


def wheels(source: str, **keys: Any) -> WheelSection:
    return SOURCES[source].model_validate({"source": source, **SECTIONS.get(source, DBC), **keys})


COUNTS = wheels("dbc", measures="counts", counts_per_metre=400.0)
SPEEDS = wheels("dbc", measures="wheel_speeds", unit=0.001)
TWIST = wheels("dbc", measures="twist", linear="A.B", angular="A.C")
