"""Numbers on a command line, with bounds: what cannot be meant is said before anything runs."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable

MOST = 1_000_000_000


def whole(least: int = 0, most: int = MOST) -> Callable[[str], int]:
    """The type of an argument that counts something, or is a seed."""

    def read(text: str) -> int:
        try:
            number = int(text)
        except ValueError:
            number = least - 1
        if not least <= number <= most:
            raise argparse.ArgumentTypeError(f"{text}: a whole number, {_bounds(least, most)}")
        return number

    return read


def real(least: float = 0.0, most: float = MOST) -> Callable[[str], float]:
    """The type of an argument that measures something."""

    def read(text: str) -> float:
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        if not least <= number <= most:
            raise argparse.ArgumentTypeError(f"{text}: a number, {_bounds(least, most)}")
        return number

    return read


def _bounds(least: float, most: float) -> str:
    return f"at least {least:g}" if most >= MOST else f"{least:g} to {most:g}"
