"""How long a robot complained of what."""

from __future__ import annotations

from pathlib import Path

from daemon_scenes import configured
from lab.play.simulator import Simulator
from lab.replay.complaints import Complaints


def test_sentences_are_counted_by_their_seconds_whatever_numbers_they_name(tmp_path: Path) -> None:
    simulator, complaints = Simulator(), Complaints()
    health = simulator.add(configured(tmp_path)).robot.health
    for second in range(1, 4):
        health.set("uwb", f"no bytes for {second}.5 s", second)
        if second == 2:
            health.set("pose", "not localised", second)
        complaints.note(simulator)
        health.set("pose", None, second)
    assert complaints.lasted() == {1: [(3, "no bytes for 3.5 s"), (1, "not localised")]}
