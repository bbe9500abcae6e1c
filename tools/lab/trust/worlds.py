"""The worlds that a team is put into.

A world is broken where its robots drive or its sensors err as the estimator's model does not say.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from lab.recordings import world
from lab.recordings.recording import Array, Recording
from lab.recordings.world import OdometryModel, RangeModel, Scene
from lab.trust import paths, sensor_faults
from lab.trust.sensor_faults import Evidence, Fault, evident_in_ranges, evident_in_wheels

RECORDED = Scene(robots=3, seconds=75.0, odometry_hz=10, range_hz=10)
"""As wrong as recorded sensors mostly are."""
CONFIGURED = replace(
    RECORDED,
    ranges=RangeModel(bias=0.30, slow=0.08, white=0.06, burst_share=0.0),
    odometry=OdometryModel(scale=0.10),
)
"""Every constant drawn as wide as the configuration allows for: windows have to be honest here,
because they know nothing else."""
LONGER = replace(RECORDED, seconds=90.0)
"""As recorded, and long enough for something to happen."""
PATROL_S = 220.0
SPOT_ANTENNA_M = 0.31


@dataclass(frozen=True)
class World:
    """A scene, who drives where in it, and what breaks the model of its sensors.

    Attributes:
        evidence: from when it shows, where that is now and then, and not all along.
    """

    scene: Scene
    truths: Callable[[np.random.Generator, Scene], list[Array]] = paths.each_alone
    faults: tuple[Fault, ...] = ()
    evidence: Evidence | None = None

    def recording(self, seed: int) -> Recording:
        """The same seed gives the same recording."""
        rng = np.random.default_rng(seed)
        recording = world.recorded(f"seed {seed}", rng, self.scene, self.truths(rng, self.scene))
        for fault in self.faults:
            recording = fault(rng, recording)
        return recording

    def evident_s(self, seed: int, localised_s: float) -> float:
        """From when it can be known that it is broken, of robots with a pose since then."""
        if self.evidence is None:
            return localised_s
        right = replace(self, faults=()).recording(seed)
        return self.evidence(right, self.recording(seed), localised_s)


def clean(robots: int) -> World:
    return World(replace(LONGER, robots=robots))


def _ranged(**model: float) -> World:
    return World(replace(LONGER, ranges=RangeModel(**model)))


def _driven(**model: float) -> World:
    return World(replace(LONGER, odometry=OdometryModel(**model)))


# as modelled, but robots see each other from few sides

CORRIDOR = World(replace(LONGER, width=40.0, height=2.6))
LINE = World(LONGER, paths.in_line)
PATROL = World(replace(RECORDED, robots=2, seconds=PATROL_S), paths.lanes)

# constants beyond what is configured

FAR_BIASES = _ranged(bias=1.0)
WRONG_SCALES = _driven(scale=0.20)
CARPET = _driven(yaw_deg_per_m=1.0)
BENT = _driven(yaw_deg_per_m=10.0)

# noise of another kind

SLOW_BIASES = _ranged(slow_s=30.0)
HEAVY_TAILS = World(LONGER, faults=(sensor_faults.heavy_tailed,))
BLOCKED = World(
    replace(LONGER, ranges=RangeModel(burst_share=0.0)),
    faults=(sensor_faults.blocked,),
    evidence=evident_in_ranges,
)
WALLED = World(LONGER, faults=(sensor_faults.walled,), evidence=evident_in_ranges)
SLIP = World(LONGER, faults=(sensor_faults.slipping,), evidence=evident_in_wheels)
ON_THE_SPOT = World(
    replace(LONGER, robots=2),
    paths.on_the_spot,
    (
        sensor_faults.off_axle({0: (SPOT_ANTENNA_M, 0.0), 1: (SPOT_ANTENNA_M, 0.0)}, True),
        sensor_faults.bearing_biased,
    ),
)
