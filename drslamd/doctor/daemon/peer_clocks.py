"""Clocks of the others: a range to a robot is worth what is known of the time at which it was."""

from __future__ import annotations

from collections.abc import Iterator

from drslamd.doctor.patient import Patient, warning
from drslamd.machine.finding import Finding

UNSURE_MS = 50.0
"""A robot at 1 m/s is 5 cm away then."""


def peer_clocks(patient: Patient) -> Iterator[Finding]:
    for robot, peer in patient.now["peers"].items():
        if not peer["alive"] or not peer["hears_us"]:
            continue  # said by another check
        unsure = peer["clock_uncertainty_ms"]
        if unsure is None:
            yield warning(
                "clocks",
                f"the clock of robot {robot} is not known yet",
                "wait some seconds; if it stays so, messages pass one way only or very late",
            )
        elif unsure > UNSURE_MS:
            yield warning(
                "clocks",
                f"the clock of robot {robot} is known to {unsure:.0f} ms only",
                "messages are late: turn off WiFi power saving (iw dev wlan0 set power_save off); "
                "DR_MODE0 shares the clock of the modules",
            )
