"""The cases of tools/trust: a world, what is wrong with the robots in it, what is promised.

Cases that are compared with a clean one, its twin, use the same seeds as that.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from lab.recordings.world import Scene
from lab.trust import mountings, promises, worlds
from lab.trust.mountings import HEALTHY, Mounting
from lab.trust.naming import NO_CAUSE, Cause
from lab.trust.promises import Promises
from lab.trust.watch import Run, watch
from lab.trust.worlds import World

SEEDS, WORLD_SEEDS, CLEAN_SEEDS, SPOT_SEEDS = 20, 5, 50, 50
FIRST_SEED, MODELLED_SEED, PATROL_SEED = 300, 100, 700
"""As in the first studies, so that figures can be compared."""

WHEELS = r"wheel|odometr|encoder|counter|slip"
RANGES = r"range|sight|bias|antenna"


@dataclass(frozen=True)
class Case:
    """One line of the tables.

    Attributes:
        what: in a few words.
        cause: what may be said of what is wrong.
        twin: name of the same case with nothing wrong.
        algorithm: of module 3.
    """

    name: str
    what: str
    world: World
    promises: Promises
    seeds: int = SEEDS
    first_seed: int = FIRST_SEED
    mounting: Mounting = HEALTHY
    cause: Cause = NO_CAUSE
    twin: str = ""
    algorithm: str = "banded"

    def run(self, seed: int, progress: Callable[[float], None] | None = None) -> Run:
        """The same seed gives the same run."""
        recording = self.world.recording(seed)
        count = len(recording.trails)
        fault = self.mounting.fault(seed, count)
        recording = fault(np.random.default_rng(seed), recording)
        extra = f'[optimizer]\nalgorithm = "{self.algorithm}"\n'
        run = watch(recording, seed, self.mounting.hardware(recording, seed), progress, extra)
        run.at_fault = self.mounting.robots(seed, count)
        run.evident_s = (
            self.mounting.evident_s(recording, seed)
            if run.at_fault
            else self.world.evident_s(seed, run.localised_s)
        )
        return run


# worlds

SLIPS = Cause(WHEELS, r"slip|odometry")
UNSEEN = Cause(RANGES, r"blocked|sight|scatter")

CLEAN_3, CLEAN_2 = "clean-3", "clean-2"
SAID = (*promises.BROKEN, *promises.CAUSE_IS_NAMED)


def _modelled(name: str, what: str, scene: Scene, promised: Promises) -> Case:
    return Case(name, what, World(scene), promised, SEEDS, MODELLED_SEED)


def _world(name: str, what: str, world: World, promised: Promises, cause: Cause = NO_CAUSE) -> Case:
    return Case(name, what, world, promised, WORLD_SEEDS, cause=cause)


def _worlds() -> list[Case]:
    w, modelled, hard = worlds, promises.AS_MODELLED, promises.HARD
    recorded = (*modelled, *promises.RARELY_WIDE)
    lanes = "two robots patrol beside each other"
    spot = "two robots turn on the spot"
    return [
        _modelled("recorded", "as wrong as recorded", w.RECORDED, recorded),
        _modelled("configured", "as wrong as configured", w.CONFIGURED, modelled),
        Case(CLEAN_3, "three robots, as recorded", w.clean(3), promises.CLEAN, CLEAN_SEEDS),
        Case(CLEAN_2, "two robots, as recorded", w.clean(2), promises.CLEAN, CLEAN_SEEDS),
        _world("corridor", "a corridor of 40 x 2.6 m", w.CORRIDOR, hard),
        _world("line", "one behind the other", w.LINE, hard),
        _world("far-biases", "biases of 1 m", w.FAR_BIASES, promises.BROKEN),
        _world("wrong-scales", "wheel scales of 20 %", w.WRONG_SCALES, promises.BROKEN),
        _world("carpet", "yaw rates of 1 deg/m", w.CARPET, promises.BROKEN),
        _world("bent", "yaw rates of 10 deg/m", w.BENT, SAID, SLIPS),
        _world("slow-biases", "biases that move in 30 s", w.SLOW_BIASES, promises.BROKEN),
        _world("heavy-tails", "range noise without bounds", w.HEAVY_TAILS, promises.BROKEN, UNSEEN),
        _world("blocked", "sight blocked 40 % of the time", w.BLOCKED, SAID, UNSEEN),
        _world("walled", "two lose sight of each other", w.WALLED, SAID, UNSEEN),
        _world("slip", "wheels slip 8 % of the time", w.SLIP, SAID, SLIPS),
        Case("patrol", lanes, w.PATROL, promises.PATROL, SEEDS, PATROL_SEED),
        Case("on-the-spot", spot, w.ON_THE_SPOT, promises.ON_THE_SPOT, SPOT_SEEDS),
    ]


def _by_closures() -> list[Case]:
    """Module 3 by relative poses alone."""
    return [
        replace(
            case,
            name=f"{case.name}-{algorithm}",
            what=f"{case.what}, {algorithm}",
            promises=promises.HONEST,
            seeds=WORLD_SEEDS,
            cause=NO_CAUSE,
            algorithm=algorithm,
        )
        for case in _worlds()
        if case.name in ("recorded", "configured", "slip")
        for algorithm in ("closures", "rbcd")
    ]


# mountings

BOTH = frozenset({"wheels.reverse_left", "wheels.reverse_right"})
SWAP = frozenset({"wheels.swap_channels"})
LEFT = frozenset({"wheels.reverse_left"})
MIRRORED = Cause(WHEELS, keys=frozenset({BOTH, SWAP, BOTH | SWAP}))
"""Ranges do not tell wheels that are swapped from wheels that run backwards."""
HALF_MIRRORED = Cause(WHEELS, keys=frozenset({LEFT}))
TRACK = Cause(WHEELS, keys=frozenset({frozenset({"wheels.track_m"})}))
SCALE = Cause(WHEELS, keys=frozenset({frozenset({"wheels.counts_per_metre"})}))
X, Y = "uwb.antenna_x_m", "uwb.antenna_y_m"
ANTENNA = Cause(RANGES, keys=frozenset({frozenset({X}), frozenset({Y}), frozenset({X, Y})}))
ENCODERS = Cause(WHEELS, WHEELS)
UNEVEN = Cause(WHEELS, r"wheel is (smaller|larger)")
BREAKS_S, SPIN_MPS = 50.0, 0.5
AHEAD, ASIDE = (0.3, 0.0), (-0.45, 0.2)


def _mounted(
    name: str, what: str, cause: Cause, promised: Promises, mounting: Mounting
) -> list[Case]:
    """In a team of two and in one of three."""
    spared = promises.OTHERS_ARE_SPARED if promised is promises.NAMED else ()
    return [
        Case(
            f"{name}-{robots}",
            f"{what}, {robots} robots",
            worlds.clean(robots),
            (*promised, *(spared if robots == 3 else ())),
            mounting=mounting,
            cause=cause,
            twin=twin,
        )
        for robots, twin in ((2, CLEAN_2), (3, CLEAN_3))
    ]


def _mountings() -> list[Case]:
    m, named, learned, noticed = mountings, promises.NAMED, promises.LEARNED, promises.NOTICED
    half = m.left_standing(BREAKS_S)
    freezing, sticking = m.standing(BREAKS_S), m.standing(BREAKS_S, BREAKS_S + 5)
    spinning = m.spinning(BREAKS_S, BREAKS_S + 10, SPIN_MPS)
    slipping = m.left_spinning(BREAKS_S, BREAKS_S + 5, SPIN_MPS)
    kinds = [
        ("reversed", "both wheels run backwards", MIRRORED, named, Mounting(m.both_reversed)),
        ("swapped", "left and right are swapped", MIRRORED, named, Mounting(m.swapped)),
        ("left-back", "left wheel runs backwards", HALF_MIRRORED, named, Mounting(m.left_reversed)),
        ("uneven", "left wheel counts a tenth more", UNEVEN, named, Mounting(m.uneven(1.1))),
        ("wide", "turns count 30 % more", TRACK, learned, Mounting(m.turning(1.3))),
        ("narrow", "turns count 30 % less", TRACK, learned, Mounting(m.turning(0.7))),
        ("half", "metres count half", SCALE, learned, Mounting(m.scaled(0.5))),
        ("half-more", "metres count 1.5 times", SCALE, learned, Mounting(m.scaled(1.5))),
        ("ahead", "antennas 0.3 m ahead", ANTENNA, learned, Mounting(antennas=3 * (AHEAD,))),
        ("aside", "antenna 0.5 m off", ANTENNA, learned, Mounting(antennas=(ASIDE,))),
        ("frozen", "counters freeze", ENCODERS, noticed, Mounting(freezing, (), BREAKS_S)),
        ("left-frozen", "left counter freezes", ENCODERS, noticed, Mounting(half, (), BREAKS_S)),
        ("stuck", "counters stick for 5 s", ENCODERS, noticed, Mounting(sticking, (), BREAKS_S)),
        ("spinning", "wheels spin for 10 s", ENCODERS, noticed, Mounting(spinning, (), BREAKS_S)),
        (
            "left-spin",
            "left wheel spins for 5 s",
            ENCODERS,
            noticed,
            Mounting(slipping, (), BREAKS_S),
        ),
    ]
    return [case for kind in kinds for case in _mounted(*kind)]


CASES = {case.name: case for case in [*_worlds(), *_by_closures(), *_mountings()]}
QUICK = {
    "recorded": 1,
    "slip": 1,
    "blocked": 1,
    "on-the-spot": 2,
    "clean-2": 1,
    "reversed-2": 1,
    "stuck-2": 1,
}
"""What shows most in little time, with how many seeds."""
