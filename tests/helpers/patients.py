"""A daemon in good order, as `doctor` sees it, and what is changed about it."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

from made_up_answers import answer

from drslamd.config import Config, parse
from drslamd.doctor.patient import Patient

CONFIG = """
robot.id = 3
team.insecure = true
uwb.port = "/dev/uwb"
wheels.source = "kobuki"
wheels.port = "/dev/wheels"
gossip.interface = "wlan0"
"""
SECONDS = 2.0


def configuration() -> Config:
    return parse(CONFIG)


def healthy_answer() -> dict[str, Any]:
    whole = answer()
    whole["peers"]["1"]["loss"] = 0.05
    whole["network"]["dropped"] = 0
    whole["uwb"]["counters"] |= {"bytes": 90_000, "bad_checksums": 0, "garbage_bytes": 0}
    whole["cpu_s"] = 1.0
    whole["loop_lag_ms"] = {"median": 0.2, "p99": 2.0}
    return whole


class Case:
    """Two answers that a test changes before they are looked at."""

    def __init__(self) -> None:
        self.before, self.now = healthy_answer(), healthy_answer()
        self.grow("uwb", "counters", "frames.accepted", by=100)
        self.grow("uwb", "counters", "bytes", by=10_000)
        self.grow("wheels", "counters", "samples.accepted", by=100)
        self.grow("network", "bytes_sent", by=1_000)
        self.grow("cpu_s", by=0.1)

    def grow(self, *path: str, by: float) -> None:
        """Between the two answers, by so much."""
        *parts, last = path
        at = self.now
        for part in parts:
            at = at[part]
        at[last] = at.get(last, 0) + by

    def stop(self, *path: str) -> None:
        """Nothing grew there."""
        *parts, last = path
        now, before = self.now, self.before
        for part in parts:
            now, before = now[part], before[part]
        now[last] = before.get(last, 0)

    def say(self, key: str, what: str, since_s: int = 60) -> None:
        """A condition that the daemon told by itself."""
        self.now["conditions"].append({"key": key, "what": what, "since_s": since_s})

    @property
    def patient(self) -> Patient:
        return Patient(configuration(), deepcopy(self.before), deepcopy(self.now), SECONDS)


def found(look: Any, case: Case) -> list[str]:
    """Sentences of one check."""
    return [finding.sentence for finding in look(case.patient)]
