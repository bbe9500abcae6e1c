"""Files that are whole or not there: a failed run never overwrites a good result."""

from __future__ import annotations

import os
from pathlib import Path


def replaced(path: Path, content: str | bytes) -> None:
    """Write beside it, then put it in its place.

    Raises:
        OSError: it cannot be made; what was there before is still there.
    """
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    data = content.encode() if isinstance(content, str) else content
    try:
        beside.write_bytes(data)
        beside.replace(path)
    except OSError:
        beside.unlink(missing_ok=True)
        raise
