"""A configuration that no daemon runs with."""

from __future__ import annotations

from pathlib import Path

import pytest

TOML = """
[robot]
id = 3
[team]
insecure = true
trust_everyone_on = "239.255.76.67"
[uwb]
port = "/dev/none"
[wheels]
source = "roboteq"
port = "/dev/none"
counts_per_metre = 1000
track_m = 0.4
[daemon]
state_dir = "STATE"
"""


@pytest.fixture
def config(tmp_path: Path) -> Path:
    path = tmp_path / "3.toml"
    path.write_text(TOML.replace("STATE", str(tmp_path / "state")))
    return path
