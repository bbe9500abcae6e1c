"""Traffic by kind of message, in a short run."""

from __future__ import annotations

import pytest
from lab.benchmark import traffic


@pytest.mark.slow
def test_traffic_is_counted_by_kind_and_is_what_the_robots_sent() -> None:
    kinds, _ = traffic.sent(1, 60.0)
    assert set(kinds) == {"graph", "odometry", "pose", "status"}
    # a heartbeat a second or two of three robots, with the framing of LCM
    assert 3 * 20 * 100 < kinds["status"] < 3 * 65 * 300
