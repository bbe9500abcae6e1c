"""Messages that this robot does not take: another key, another version, a made-up start."""

from __future__ import annotations

from collections.abc import Iterator

from drslamd.doctor.patient import Patient
from drslamd.machine.finding import Finding


def team_key(patient: Patient) -> Iterator[Finding]:
    keys = ("team.wrong_tag", "team.wrong_version", "team.beyond_clocks")
    yield from patient.told("team key", *keys)
