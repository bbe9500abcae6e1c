"""Numbers as digests take them."""

from __future__ import annotations

import numpy as np

from drslamd.slam.se2 import Array

RESOLUTION = 1e-6
"""m, rad and their squares: what differs by less counts as equal in a digest, because sines and
cosines of different processors differ in their last digits."""
MOST = 2.0**62
"""Times that: whatever is more counts as this, on any processor."""


def as_digested(values: Array) -> bytes:
    """What two arrays share whose values are nearly the same."""
    steps = np.nan_to_num(np.rint(values / RESOLUTION))
    return bytes(np.clip(steps, -MOST, MOST).astype(np.int64).tobytes())
