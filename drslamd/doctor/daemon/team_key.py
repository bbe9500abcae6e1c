"""Messages that this robot does not take: of another key or version, recorded, or made up."""

from __future__ import annotations

from collections.abc import Iterator

from drslamd.doctor.patient import Patient
from drslamd.machine.finding import Finding


def team_key(patient: Patient) -> Iterator[Finding]:
    keys = ("team.recording", "team.wrong_tag", "team.wrong_version", "team.beyond_clocks")
    yield from patient.told("team key", *keys)
