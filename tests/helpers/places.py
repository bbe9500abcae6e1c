"""Where things are."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]
SHARED = REPOSITORY.parent / "shared"
"""Recordings and test vectors that are not part of the project; their tests skip without."""

Recorded = Callable[[str, object], None]
"""Takes ``"measured"`` and what the test of a row of the fault matrix found."""
