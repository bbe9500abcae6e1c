"""Tables of faults, doses and expectations: one for each cell of the matrix, and mixtures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lab.soak.faults import FAULTS

MIXED = "mixed"
LASTS_S = 12.0
FEWEST, MOST = 3, 6
"""Faults of a mixed run."""


@dataclass(frozen=True)
class Expectation:
    """A figure of a run (`lab.soak.run.Figures`) and what it is at most."""

    figure: str
    most: float


@dataclass(frozen=True)
class Scenario:
    """What happens, and what is expected beyond what holds always.

    Attributes:
        faults: names and doses.
        lasts_s: how long they last.
        says: a pattern that some robot's sentences fit meanwhile.
    """

    name: str
    faults: tuple[tuple[str, float], ...]
    expects: tuple[Expectation, ...] = ()
    says: str = ""
    lasts_s: float = LASTS_S

    @property
    def rows(self) -> tuple[str, ...]:
        """Of the fault matrix."""
        return tuple(dict.fromkeys(row for name, _ in self.faults for row in FAULTS[name].rows))

    @property
    def what(self) -> str:
        return "; ".join(FAULTS[name].what.format(dose) for name, dose in self.faults)


HEALED_SOON = (Expectation("healed_s", 30.0),)
"""Without loss; the bench itself waits a minute."""
TRUE = (Expectation("liars", 0.0),)

_SAID = {
    "uwb-cut": r"UWB module",
    "wheels-cut": r"wheels",
    "disk-full": r"No space left",
    "read-only": r"Read-only",
    "one-id-twice": r"two robots use id",
}
_LASTING = ("one-id-twice",)
"""An id that two robots had is used again after half a minute."""
_LASTS_S = {"disk-full": 30.0, "read-only": 30.0}
"""A robot writes once a minute."""
_EACH_DOSE = ("loss", "outliers", "range-dropout")
"""Kinds of which every dose is a cell; of others the strongest, weaker ones come in mixtures."""


def _alone() -> list[Scenario]:
    """Each fault alone, with each dose or its strongest."""
    out = []
    for name, fault in FAULTS.items():
        doses = fault.doses if name in _EACH_DOSE else fault.doses[-1:]
        for dose in doses:
            title = f"{name}-{dose:g}" if len(doses) > 1 else name
            is_sensor = fault.rows[0][0] in "DM"
            lasts_s = _LASTS_S.get(name, LASTS_S)
            is_quick = not is_sensor and name not in _LASTING
            expects = (*HEALED_SOON, *TRUE) if is_quick else TRUE
            out.append(Scenario(title, ((name, dose),), expects, _SAID.get(name, ""), lasts_s))
    return out


SCENARIOS = {scenario.name: scenario for scenario in _alone()}


def mixed(seed: int) -> Scenario:
    """Three to six faults at once; the same seed draws the same ones."""
    rng = np.random.default_rng([seed, 2])
    count = int(rng.integers(FEWEST, MOST + 1))
    names = sorted(str(name) for name in rng.choice(list(FAULTS), count, replace=False))
    faults = tuple((name, float(rng.choice(FAULTS[name].doses))) for name in names)
    return Scenario(MIXED, faults)


def scenario_of(name: str, seed: int) -> Scenario:
    """
    Raises:
        KeyError: there is none of this name.
    """
    return mixed(seed) if name == MIXED else SCENARIOS[name]
