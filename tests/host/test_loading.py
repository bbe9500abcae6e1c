"""What is not loaded, and that it can be."""

from __future__ import annotations

import hashlib
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

from drslamd.host import loading
from drslamd.host.loading import without, without_openssl


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


@pytest.mark.parametrize("missing", ["_sha3", "sha2"])
def test_a_python_without_hashes_of_its_own_keeps_those_of_openssl(
    missing: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    lacking = {"_sha2", "_sha256"} if missing == "sha2" else {missing}
    for lacks in (False, True):
        monkeypatch.setattr(
            loading, "find_spec", lambda name, lacks=lacks: not (lacks and name in lacking)
        )
        monkeypatch.delitem(sys.modules, "_hashlib", raising=False)
        with without_openssl():
            assert ("_hashlib" in sys.modules) is not lacks


def test_who_brings_what_was_left_out_keeps_it(monkeypatch: pytest.MonkeyPatch) -> None:
    for there in (None, "brought"):
        with without("nobody_has_this"):
            if there is None:
                del sys.modules["nobody_has_this"]
            else:
                monkeypatch.setitem(sys.modules, "nobody_has_this", there)
        left: object = sys.modules.pop("nobody_has_this", None)
        assert left == there
