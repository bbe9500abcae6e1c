"""What can go wrong, each with its rows of the fault matrix and its doses.

A fault is put onto a stage before anything happens; it lasts from the stage's begin to its end, and
everything is whole again afterwards.
"""

from __future__ import annotations

from dataclasses import dataclass

from lab.soak import radio
from lab.soak.harm import in_computers, in_sensors, on_the_air
from lab.soak.stage import Put


@dataclass(frozen=True)
class Fault:
    """One kind.

    Attributes:
        rows: of the fault matrix.
        what: in a few words, with {} for the dose.
        doses: that a mixed run draws from.
    """

    rows: tuple[str, ...]
    what: str
    doses: tuple[float, ...]
    put: Put


FAULTS: dict[str, Fault] = {
    "loss": Fault(
        ("N1",),
        "{:.0%} of datagrams lost",
        (0.1, 0.3, 0.5, 0.7),
        lambda s, dose: s.during(radio.lossy(dose)),
    ),
    "bursts": Fault(
        ("N2",),
        "links dead in bursts, {:.0%} of the time",
        (0.3,),
        lambda s, dose: s.during(radio.bursty(dose)),
    ),
    "dark": Fault(
        ("N2",),
        "nothing heard for 5 s of {:.0f}",
        (10.0,),
        lambda s, dose: s.during(radio.dark(dose, 5.0)),
    ),
    "copies": Fault(
        ("N3",),
        "every datagram {:.0f} times",
        (2, 10),
        lambda s, dose: s.during(radio.copied(int(dose))),
    ),
    "late": Fault(
        ("N4",),
        "datagrams up to {:.0f} s late, in any order",
        (1.0, 5.0),
        lambda s, dose: s.during(radio.late(dose)),
    ),
    "one-way": Fault(("N5",), "a link dead on {:.0f} of its ways", (1, 2), on_the_air.one_way),
    "parted": Fault(
        ("N6",),
        "one robot cut off",
        (0,),
        lambda s, dose: s.during(radio.parted({s.one()})),
    ),
    "flapping": Fault(
        ("N6",),
        "one robot cut off every other {:.0f} s",
        (3.0,),
        lambda s, dose: s.during(radio.parted({s.one()}, dose)),
    ),
    "short": Fault(
        ("N5",),
        "nobody heard beyond {:.0f} m",
        (5.0,),
        lambda s, dose: s.during(radio.short(dose, on_the_air.apart(s))),
    ),
    "damage": Fault(
        ("N7", "S10"),
        "{:.0%} of datagrams damaged",
        (0.05, 0.5),
        lambda s, dose: s.during(s.radio.corrupting(dose)),
    ),
    "stranger": Fault(
        ("N7", "S1"), "a stranger says {:.0f} things a second", (2, 20), on_the_air.stranger
    ),
    "replay": Fault(("S3",), "{:.0f} replays a second", (2, 20), on_the_air.replay),
    "oversize": Fault(("N9",), "datagrams of {:.0f} bytes", (1_401, 9_000), on_the_air.oversize),
    "blocked": Fault(
        ("M3",), "a pair's ranges up to {:.1f} m too long", (0.3, 3.0), in_sensors.blocked
    ),
    "outliers": Fault(
        ("M4",), "{:.0%} of ranges anything", (0.01, 0.1, 0.3, 0.5), in_sensors.outliers
    ),
    "range-dropout": Fault(
        ("M7",), "{:.0%} of ranges missing", (0.5, 0.9, 1.0), in_sensors.range_dropout
    ),
    "frozen-ranges": Fault(
        ("M3",), "a module says its last ranges for ever", (0,), in_sensors.frozen_ranges
    ),
    "module-reset": Fault(("D11",), "a module begins anew", (0,), in_sensors.module_reset),
    "uwb-cut": Fault(("D5",), "a module's cable pulled", (0,), in_sensors.cut("uwb")),
    "wheels-cut": Fault(("D5",), "a base's cable pulled", (0,), in_sensors.cut("wheels")),
    "garbage": Fault(
        ("D1",), "{:.0%} of a robot's bytes are garbage", (0.1, 0.5), in_sensors.garbage
    ),
    "bit-errors": Fault(
        ("D2",), "{:g} of a robot's bits turned over", (1e-5, 1e-3), in_sensors.bit_errors
    ),
    "stuck": Fault(("M1",), "a robot's encoders stuck", (0,), in_sensors.stuck),
    "spinning": Fault(
        ("M2",), "a robot's wheels slip by {:.1f} m/s", (0.2, 0.5), in_sensors.spinning
    ),
    "counter-reset": Fault(
        ("D11",), "a base counts from zero again", (0,), in_sensors.counter_reset
    ),
    "drift": Fault(
        ("T4",), "clocks drift by {:.0f} ppm, in turn fast and slow", (200,), in_computers.drift
    ),
    "suspended": Fault(("T2",), "a computer asleep for {:.0f} s", (1, 10), in_computers.suspended),
    "stalled": Fault(
        ("T3",), "a process that does nothing for {:.1f} s", (0.1, 1, 5), in_computers.stalled
    ),
    "disk-full": Fault(("O2",), "a full disk", (0,), in_computers.disk("No space left on device")),
    "read-only": Fault(
        ("S7",), "a disk that is read-only", (0,), in_computers.disk("Read-only file system")
    ),
    "restarts": Fault(
        ("S6", "O5"), "a robot restarted {:.0f} times", (1, 3), in_computers.restarts
    ),
    "wiped": Fault(("S7",), "a robot restarted with an empty disk", (0,), in_computers.wiped),
    "one-id-twice": Fault(
        ("S8",), "a robot's card copied into another, {:.0f} s later", (0, 4), in_computers.doubled
    ),
    "leaves": Fault(("O4",), "a robot leaves in order and comes back", (0,), in_computers.left),
}
