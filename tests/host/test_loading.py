"""What is not loaded, and that it can be."""

from __future__ import annotations

import hashlib
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

from drslamd.host.loading import without


def test_a_package_is_left_out_only_for_a_moment_and_only_where_nobody_uses_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "colourful.py").write_text("")
    monkeypatch.syspath_prepend(tmp_path)
    with without("colourful"), pytest.raises(ImportError):
        importlib.import_module("colourful")
    known = importlib.import_module("colourful")
    with without("colourful"):
        assert importlib.import_module("colourful") is known
    assert sys.modules.pop("colourful") is known


def test_the_command_does_not_load_openssl_and_whoever_wants_it_gets_it() -> None:
    program = """
import sys, drslamd.cli, hashlib, hmac
print("asyncio" in sys.modules, "ssl" in sys.modules, "_hashlib" in sys.modules)
print(hashlib.blake2b(b"", digest_size=2, key=b"k").hexdigest(), hmac.compare_digest(b"a", b"b"))
import ssl
"""
    said = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True)
    tag = hashlib.blake2b(b"", digest_size=2, key=b"k").hexdigest()
    assert said.stdout.decode().split() == ["True", "False", "False", tag, "False"]
