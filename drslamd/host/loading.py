"""What other packages bring with them, and a daemon never uses."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def without(*packages: str) -> Iterator[None]:
    """Whoever looks for one of these meanwhile and can do without it does; they are there for those
    who had them before, and for everybody afterwards."""
    hidden = [package for package in packages if package not in sys.modules]
    # None is how Python says that there is no such package
    sys.modules.update(dict.fromkeys(hidden))  # type: ignore[arg-type]
    try:
        yield
    finally:
        for package in hidden:
            del sys.modules[package]
