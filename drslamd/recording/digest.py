"""A number of four bytes for what a robot did: equal where everything that it did was equal.

It finds differences between a run and its replay. It protects nothing: CRC-32 is easily forged.
"""

from __future__ import annotations

import dataclasses
import json
import zlib
from collections.abc import Mapping
from enum import Enum
from typing import Any

import numpy as np

from drslamd.events import Effect, Note, Restart, Save, Send, Solve, Write
from drslamd.slam.consistency.checked import Checked


def of_effect(effect: Effect, digest: int = 0) -> int:
    """The digest of everything so far, and of this."""
    return zlib.crc32(_bytes(effect), digest)


def _bytes(effect: Effect) -> bytes:
    if isinstance(effect, Send):
        return effect.channel.encode() + b"\0" + effect.payload
    if isinstance(effect, Write):
        return effect.port.encode() + b"\0" + effect.data
    if isinstance(effect, Solve):
        return f"solve {effect.job_id} {effect.name}".encode()
    return f"{type(effect).__name__} {text_of(effect)}".encode()


def text_of(effect: Save | Restart | Note) -> str:
    """An effect that is rare, as JSON."""
    if isinstance(effect, Save):
        content: dict[str, Any] = {"state": effect.state}
    elif isinstance(effect, Restart):
        content = {"above": effect.above, "why": effect.why}
    else:
        content = {"level": effect.level.value, "event": effect.event, "fields": effect.fields}
    return json.dumps(content, default=str)


def of_result(result: Any, digest: int = 0) -> int:
    """Likewise of what a computation found, down to the last bit of every number."""
    if isinstance(result, np.ndarray):
        data = np.ascontiguousarray(result)
        return zlib.crc32(data.tobytes(), zlib.crc32(repr(data.shape).encode(), digest))
    if isinstance(result, Checked):
        return of_result(result.consistency.kept_vertices(), digest)
    if dataclasses.is_dataclass(result) and not isinstance(result, type):
        # (what two results are not compared by is how they were found)
        said = [f.name for f in dataclasses.fields(result) if f.compare]
        return of_result([getattr(result, name) for name in said], digest)
    if isinstance(result, Enum):
        return of_result(result.name, digest)
    if isinstance(result, Mapping):
        return of_result([part for item in result.items() for part in item], digest)
    if isinstance(result, (set, frozenset)):
        return of_result(sorted(result), digest)
    if isinstance(result, (list, tuple)):
        for part in result:
            digest = of_result(part, digest)
        return zlib.crc32(b"%d" % len(result), digest)
    if isinstance(result, (float, np.floating)):
        return zlib.crc32(float(result).hex().encode(), digest)
    if isinstance(result, (bool, np.bool_, int, np.integer)):
        return zlib.crc32(b"%d" % int(result), digest)
    if result is None or isinstance(result, str):
        return zlib.crc32(repr(result).encode(), digest)
    raise TypeError(f"a computation found a {type(result).__name__}, which has no digest")
