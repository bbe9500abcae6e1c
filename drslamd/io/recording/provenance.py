"""Where a recording comes from: who, with which configuration, on which computer, at what time."""

from __future__ import annotations

import platform
import sys
import time
from hashlib import blake2b
from typing import Any

import numpy as np
import scipy

from drslamd import __version__
from drslamd.config import Config
from drslamd.io.clock import Clock
from drslamd.slam.calibration.sensor_calibration import UNLEARNED, SensorCalibration


def provenance(
    config: Config, dbc_text: str, key: bytes, taped: SensorCalibration = UNLEARNED
) -> dict[str, Any]:
    """Everything that a replay needs, and what a reader of the recording asks first.

    The team key is not in it: who has a recording must not be able to forge messages.
    """
    return {
        "drslamd": __version__,
        "python": sys.version.split()[0],
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "host": platform.node(),
        "machine": platform.machine(),
        "system": platform.release(),
        "configuration": config.model_dump(mode="json", exclude_none=True),
        "dbc": dbc_text,
        "taped": taped.state(),
        "key": fingerprint(key),
    }


def fingerprint(key: bytes) -> str:
    """Tells two team keys apart and says nothing of either."""
    return blake2b(key, digest_size=8, person=b"drslamd logkey").hexdigest()


def clocks(clock: Clock) -> dict[str, int]:
    """The robot's clock, what the wall clock (us since 1970) shows meanwhile, and how long that
    took."""
    utime = clock.now()
    wall_us = time.time_ns() // 1_000
    return {"utime": utime, "wall_us": wall_us, "within_us": clock.now() - utime}
