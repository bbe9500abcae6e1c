"""What tools/trust promises of each kind of case; the bounds stand here and nowhere else."""

from __future__ import annotations

from dataclasses import dataclass

from lab.trust.figures import Figures

INFINITE = float("inf")


@dataclass(frozen=True)
class Promise:
    """A figure (of `figures.Figures`) and where it has to be, both bounds included."""

    figure: str
    least: float = -INFINITE
    most: float = INFINITE

    def is_kept(self, reached: float) -> bool:
        """What could not be measured (NaN) is not kept."""
        return self.least <= reached <= self.most


Promises = tuple[Promise, ...]


@dataclass(frozen=True)
class Check:
    """A promise of a case and what became of it."""

    case: str
    promise: Promise
    reached: float

    @property
    def is_kept(self) -> bool:
        return self.promise.is_kept(self.reached)


def checks(case: str, promised: Promises, found: Figures) -> list[Check]:
    return [Check(case, promise, float(getattr(found, promise.figure))) for promise in promised]


RIGHT_NAMES: Promises = (Promise("wrong_names", most=0),)
NEVER_DOUBTED: Promises = (*RIGHT_NAMES, Promise("doubtful", most=0.01))
"""Where nothing is wrong nothing is said to be."""
RARELY_WIDE: Promises = (Promise("wide", most=0.05),)

AS_MODELLED: Promises = (
    Promise("nees", 0.8, 1.25),
    Promise("inside", 0.90, 0.99),
    Promise("pair_inside", 0.93),
    Promise("closure_nees", 0.8, 1.25),
    Promise("ate_x_today", most=1.03),
    *NEVER_DOUBTED,
)
"""Covariances are true, and nothing of the accuracy is paid for that."""

HONEST: Promises = (
    Promise("liars", most=0.002),
    Promise("pair_inside", 0.90),
    Promise("inside", 0.85),
)
CLEAN: Promises = (
    *HONEST,
    Promise("ate_x_today", most=1.03),
    *NEVER_DOUBTED,
    *RARELY_WIDE,
)
BROKEN: Promises = (*HONEST, Promise("ate_x_today", most=1.0), *RIGHT_NAMES)
HARD: Promises = (*HONEST, Promise("ate_x_today", most=1.0), *NEVER_DOUBTED)
CAUSE_IS_NAMED: Promises = (Promise("cause_s", most=20.0),)

PATROL: Promises = (Promise("inside", 0.90), Promise("bias_m", most=0.7))
ON_THE_SPOT: Promises = (Promise("wrong_unique", most=0),)

LEARNED: Promises = (
    Promise("connected", 0.95),
    Promise("ate_x_clean", most=1.3),
    *RIGHT_NAMES,
)
"""Mountings that calibrate themselves."""

NAMED: Promises = (Promise("named", 0.90), *RIGHT_NAMES)
"""Mountings that are named."""
OTHERS_ARE_SPARED: Promises = (Promise("healthy_x_clean", most=1.2),)
"""In teams of three."""

NOTICED: Promises = (
    Promise("said_s", most=5.0),
    Promise("ate_x_clean", most=2.0),
    Promise("liars", most=0.0),
    *RIGHT_NAMES,
)
"""Encoders that break on the way."""
