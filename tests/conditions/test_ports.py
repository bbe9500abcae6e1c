"""What is said of a port that cannot be used."""

from __future__ import annotations

from drslamd.conditions.ports import REMEDIES, port_cause, port_key, port_remedy
from drslamd.events import PortCondition


def test_every_condition_but_the_good_one_has_a_remedy() -> None:
    assert set(REMEDIES) == set(PortCondition) - {PortCondition.OPEN}


def test_the_key_of_the_configuration_is_named() -> None:
    assert port_key("wheels") == "wheels.port"
    assert port_key("wheels", is_serial=False) == "wheels.can"
    assert port_remedy("uwb", PortCondition.UNFIT) == "correct uwb.port"
    assert port_remedy("wheels", PortCondition.MISSING, is_serial=False).endswith("wheels.can")
    assert port_cause("uwb", PortCondition.BUSY, "/dev/x: why") == (
        "uwb: in use by another program: /dev/x: why"
    )
