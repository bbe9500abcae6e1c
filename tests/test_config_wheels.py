"""Which base is which section of the configuration, and what one that is read by DBC must name."""

from __future__ import annotations

import pytest
from pydantic import TypeAdapter, ValidationError

from drslamd.config_wheels import MAX_OPTIONS, SOURCES, DbcSection, Wheels

WHEELS = TypeAdapter(Wheels)
DBC = {"source": "dbc", "dbc_file": "base.dbc", "track_m": 0.5}
COUNTS = {**DBC, "measures": "counts", "left": "A.L", "right": "A.R", "counts_per_metre": 100.0}
TWIST = {**DBC, "measures": "twist", "linear": "A.V", "angular": "A.W"}


def fault(section: dict[str, object]) -> str:
    with pytest.raises(ValidationError) as caught:
        WHEELS.validate_python(section)
    return str(caught.value)


def test_the_source_tells_the_base() -> None:
    for source, kind in SOURCES.items():
        assert str(kind.model_fields["source"].annotation) == f"typing.Literal['{source}']"
    assert isinstance(WHEELS.validate_python(COUNTS), DbcSection)
    assert "abacus" in fault({**COUNTS, "source": "abacus"})


@pytest.mark.parametrize("key", ["left", "right"])
def test_counts_need_a_signal_of_each_side(key: str) -> None:
    assert f'needs {key} as "Message.Signal"' in fault({**COUNTS, key: ""})
    assert f'needs {key} as "Message.Signal"' in fault({**COUNTS, key: "Signal"})


def test_counts_need_their_number_per_metre_and_speeds_do_not() -> None:
    named = {key: value for key, value in COUNTS.items() if key != "counts_per_metre"}
    assert "needs counts_per_metre" in fault(named)
    speeds = WHEELS.validate_python({**named, "measures": "wheel_speeds"})
    assert isinstance(speeds, DbcSection)
    assert speeds.counts_per_metre is None


def test_an_adapter_takes_a_few_named_values_and_nothing_else() -> None:
    def can(options: object) -> dict[str, object]:
        return {**COUNTS, "can": {"options": options}}

    assert WHEELS.validate_python(can({"index": 1, "fd": False, "serial": "A1"}))
    assert WHEELS.validate_python(can({f"key{k}": k for k in range(MAX_OPTIONS)}))
    for many in ({f"key{k}": k for k in range(MAX_OPTIONS + 1)}, 3, [1]):
        assert "at most 16 names" in fault(can(many))
    for value in ([1], float("inf"), "\x00"):
        assert "each name takes a finite number" in fault(can({"x": value}))


def test_only_a_twist_has_a_turn_to_reverse_and_only_wheels_have_sides() -> None:
    twist = WHEELS.validate_python({**TWIST, "reverse_angular": True})
    assert isinstance(twist, DbcSection)
    assert twist.reverse_angular
    assert "has no sides to reverse" in fault({**TWIST, "reverse_left": True})
    wheeltec = {"source": "wheeltec", "port": "/p", "track_m": 0.3}
    assert WHEELS.validate_python({**wheeltec, "reverse_gyro": True})
    assert "has no sides to reverse" in fault({**wheeltec, "reverse_right": True})
    assert "reverse_angular is for" in fault({**COUNTS, "reverse_angular": True})
