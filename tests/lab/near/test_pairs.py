"""Relative poses of a short drive are about as wrong as they say, and odom never jumps."""

from __future__ import annotations

import pytest
from lab.near import pairs
from lab.recordings import world


@pytest.mark.slow
def test_what_is_told_of_peers_is_honest_and_odom_is_smooth() -> None:
    tally = pairs.honesty(world.simulate(world.Scene(), 101), 101)
    assert tally["pair/nees"].n > 50
    assert tally["pair/nees"].mean < 1.5
    assert tally["pair/age"].mean < 1.5
    assert tally["odom/step"].most < 1.0
