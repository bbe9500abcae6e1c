"""What other packages bring with them, and a daemon never uses."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec

OWN_HASHES = ("_md5", "_sha1", "_sha3", "_blake2")
OWN_SHA2 = ("_sha2", "_sha256")
"""Python's own, to the same bits as OpenSSL's, of which it may have been built without some; the
second line is one module since 3.12."""
LOOK_FOR_OPENSSL = ("asyncio", "hashlib", "hmac")


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
            if sys.modules.get(package, package) is None:
                del sys.modules[package]


@contextmanager
def without_openssl() -> Iterator[None]:
    """asyncio and hashlib do without it: of the 80 MB of a daemon it would take 5, and no verb of
    ours speaks TLS."""
    hashes = ["_hashlib"] if _has_own_hashes() else []
    with without("ssl", *hashes):
        for name in LOOK_FOR_OPENSSL:
            importlib.import_module(name)
        yield


def _has_own_hashes() -> bool:
    return all(map(find_spec, OWN_HASHES)) and any(map(find_spec, OWN_SHA2))
