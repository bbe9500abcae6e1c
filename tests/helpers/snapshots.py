"""An object and all in it as plain values, to see whether anything changed."""

from __future__ import annotations

from enum import Enum
from typing import Any

import numpy as np


def plain(value: Any) -> Any:
    """An object and all in it as plain values that can be compared."""
    if isinstance(value, np.ndarray):
        return value.tobytes()
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)) or type(value).__name__ == "deque":
        return [plain(item) for item in value]
    if hasattr(value, "__dict__"):
        return {key: plain(item) for key, item in vars(value).items()}
    return value
