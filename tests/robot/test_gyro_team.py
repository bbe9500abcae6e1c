"""A team whose bases have gyros, from the bytes of a Kobuki to the poses of everybody."""

from __future__ import annotations

import pytest
from lab.play import virtual_team
from lab.recordings import world
from lab.score import outcome

KEYS = "gyro_noise_deg_per_sqrt_s = 0.01\ngyro_bias_deg_per_h = 10.0\n"


@pytest.mark.slow
def test_headings_are_those_of_the_gyros_and_all_know_how_wrong_those_are() -> None:
    """A minute; by their wheels alone the headings of this team are 0.75 degrees off."""
    recording = world.with_gyros(world.simulate(world.Scene(seconds=60.0), 1), 1)
    simulator = virtual_team.start(recording, 1, extra=KEYS)
    simulator.run(recording.duration + virtual_team.SETTLE_S)
    result = virtual_team.outcome(simulator)
    assert result.is_one_team
    assert outcome.score(recording, result)["team"]["rot_mean_centred_deg"] < 0.25
    for member in simulator.members.values():
        chains = member.robot.back.graph.chains.values()
        spans = {data.chain.robot: data.model.noise.gyro_span for data in chains}
        assert len(spans) == 3
        assert all(span is not None for span in spans.values())
        assert not [key for key in member.robot.health.sentences() if key.startswith("gyro")]
