"""Is there anything to read?"""

from __future__ import annotations

import select


def has_bytes(descriptor: int) -> bool:
    """Would reading say something now: bytes, or that the other side is gone?"""
    if descriptor < 0:
        return False
    poll = select.poll()
    poll.register(descriptor, select.POLLIN)
    return bool(poll.poll(0))
