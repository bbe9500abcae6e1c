"""Two robots with one id, or two modules."""

from __future__ import annotations

from collections.abc import Iterator

from drslamd.doctor.patient import Patient
from drslamd.machine.finding import Finding, Severity


def duplicate_id(patient: Patient) -> Iterator[Finding]:
    keys = ("team.own_id_used", "team.id_used_twice", "team.uwb_id")
    yield from patient.told("duplicate id", *keys, severity=Severity.ERROR)
