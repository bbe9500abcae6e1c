"""asyncio and hashlib without OpenSSL: of the 80 MB of a daemon it would take 5.

No verb of ours speaks TLS, and the hashes are Python's own, to the same bits. To be imported before
anything else that imports them.
"""

from __future__ import annotations

from importlib.util import find_spec

from drslamd.host.loading import without

_OWN_HASHES = ("_md5", "_sha1", "_sha3", "_blake2")
"""A Python may have been built without some of these."""
_hashes = ["_hashlib"] if all(map(find_spec, _OWN_HASHES)) else []

with without("ssl", *_hashes):
    import asyncio
    import hashlib
    import hmac

__all__ = ["asyncio", "hashlib", "hmac"]
