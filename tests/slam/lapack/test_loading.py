"""LAPACK without the rest of scipy, and with it where it cannot be had alone."""

from __future__ import annotations

import subprocess
import sys
from importlib.machinery import ExtensionFileLoader, PathFinder

import pytest
from places import REPOSITORY

from drslamd.slam.lapack import loading

ALONE = """
import sys
from drslamd.slam.lapack.loading import address, cython_lapack
first = address(cython_lapack(), "dpotrf")
assert "scipy.linalg" not in sys.modules, sorted(m for m in sys.modules if "scipy" in m)
import scipy.linalg, scipy.linalg.cython_lapack
from scipy.linalg import cython_lapack as later, cholesky
assert cholesky([[4.0]])[0, 0] == 2.0
assert address(later, "dpotrf") == address(cython_lapack(), "dpotrf") == first
"""


def test_it_is_loaded_alone_and_the_package_can_come_later() -> None:
    subprocess.run([sys.executable, "-c", ALONE], cwd=REPOSITORY, check=True, timeout=60)


def refuses(*_: object) -> None:
    raise ImportError


@pytest.mark.parametrize(
    ("who", "method", "does"),
    [
        (PathFinder, "find_spec", lambda *_, **__: None),
        (ExtensionFileLoader, "create_module", refuses),
    ],
    ids=["it is no file", "it does not load"],
)
def test_where_it_cannot_be_had_alone_the_package_is_imported(
    who: type, method: str, does: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = loading.cython_lapack()
    monkeypatch.setattr(loading, "PACKAGE", "as if nobody had imported it")
    monkeypatch.setattr(who, method, does)
    assert loading._alone() is None
    assert loading.cython_lapack() is package
