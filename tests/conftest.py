"""Shared by all tests; how the suite polices itself is in policing.py, how interpreters share
it in sharing.py."""

from __future__ import annotations

from pathlib import Path

import pytest
from places import SHARED

pytest_plugins = ["policing", "pytester", "sharing"]


@pytest.fixture(scope="session")
def vectors() -> Path:
    """Folder of the shared wire-format vectors."""
    folder = SHARED / "reference" / "vectors"
    if not folder.is_dir():
        pytest.skip(f"no shared vectors at {folder}")
    return folder
