"""Where a recording was made, seen from here."""

from __future__ import annotations

import platform
import sys
from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy

from drslamd import __version__

HERE = {
    "drslamd": __version__,
    "python": sys.version.split()[0],
    "numpy": np.__version__,
    "scipy": scipy.__version__,
    "machine": platform.machine(),
}
"""What decides over the last bits of a result."""


def strangers(provenance: Mapping[str, Any]) -> list[str]:
    """A sentence for each thing that is another one here than where it was recorded."""
    return [
        f"recorded with {name} {provenance.get(name)}, replayed with {here}: bits may differ"
        for name, here in HERE.items()
        if provenance.get(name) != here
    ]
