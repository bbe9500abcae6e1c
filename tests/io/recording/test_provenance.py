"""What a recording says of its origin, and what it keeps to itself."""

from __future__ import annotations

import json
import time
from pathlib import Path

import numpy as np
import pytest
import scipy
from daemon_scenes import Stepped, configured

from drslamd import __version__
from drslamd.config import Config
from drslamd.io.recording.provenance import clocks, fingerprint, provenance
from drslamd.slam.calibration.sensor_calibration import SensorCalibration
from drslamd.slam.graph.estimate import Learned

KEY = bytes(range(32))


def test_it_names_versions_host_and_the_whole_configuration(tmp_path: Path) -> None:
    config = configured(tmp_path)
    taped = SensorCalibration(scale=Learned(0.02, 0.006))
    said = json.loads(json.dumps(provenance(config, "BO_ 1", KEY, taped)))
    assert said["drslamd"] == __version__
    assert (said["numpy"], said["scipy"]) == (np.__version__, scipy.__version__)
    assert Config.model_validate_json(json.dumps(said["configuration"])) == config
    assert said["dbc"] == "BO_ 1"
    assert SensorCalibration.of_state(said["taped"]) == taped
    assert said["host"]


@pytest.mark.row("S12")
def test_the_team_key_is_not_in_it_but_can_be_told_from_others(tmp_path: Path) -> None:
    text = json.dumps(provenance(configured(tmp_path), "", KEY))
    assert KEY.hex() not in text
    assert fingerprint(KEY) in text
    assert fingerprint(KEY) != fingerprint(bytes(32))
    assert len(fingerprint(KEY)) == 16


def test_the_wall_clock_is_held_beside_the_robots_own() -> None:
    clock, before = Stepped(), time.time_ns() // 1_000
    said = clocks(clock)
    assert said["utime"] == clock.utime
    assert 0 <= said["wall_us"] - before < 60_000_000
    assert said["within_us"] == 0
