"""Shared by all tests; how the suite polices itself is in policing.py."""

from __future__ import annotations

from pathlib import Path

import pytest
from places import SHARED

pytest_plugins = ["policing", "pytester"]


@pytest.fixture(scope="session")
def vectors() -> Path:
    """Folder of the shared wire-format vectors."""
    folder = SHARED / "reference" / "vectors"
    if not folder.is_dir():
        pytest.skip(f"no shared vectors at {folder}")
    return folder
