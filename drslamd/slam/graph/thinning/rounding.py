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
    steps = np.rint(values / RESOLUTION)
    np.copyto(steps, 0.0, where=steps != steps)  # (what is no number; ten a second are digested)
    np.maximum(np.minimum(steps, MOST, out=steps), -MOST, out=steps)
    return steps.astype(np.int64).tobytes()
