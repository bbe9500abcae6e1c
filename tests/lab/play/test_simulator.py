"""Virtual time: clocks, a network that loses, delays and repeats as it was told, one seed."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from lab.play.simulator import Clock, Member, Network, Simulator
from scipy.stats import binom

from drslamd.config import parse
from drslamd.events import Datagram, Event
from drslamd.gossip import messages

TOML = """
[robot]
id = {}
[team]
insecure = true
[uwb]
port = "/dev/uwb"
[wheels]
source = "kobuki"
port = "/dev/wheels"
"""


def arrivals(network: Network, count: int = 20_000, seed: int = 1) -> list[list[int]]:
    rng = np.random.default_rng(seed)
    return [network.arrivals(rng, 1_000_000) for _ in range(count)]


@pytest.mark.parametrize("loss", [0.0, 0.1, 0.5, 1.0])
def test_messages_are_lost_as_often_as_was_said(loss: float) -> None:
    heard = sum(map(len, arrivals(Network(loss=loss))))
    low, high = binom.interval(0.9999, 20_000, 1 - loss)
    assert low <= heard <= high


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_messages_are_repeated_as_often_as_was_said(share: float) -> None:
    copies = Counter(map(len, arrivals(Network(duplicate=share))))
    low, high = binom.interval(0.9999, 20_000, share)
    assert low <= copies[2] <= high
    assert copies[1] + copies[2] == 20_000


def test_copies_are_lost_each_for_itself() -> None:
    copies = Counter(map(len, arrivals(Network(duplicate=1.0, loss=0.5))))
    for count, share in ((0, 0.25), (1, 0.5), (2, 0.25)):
        low, high = binom.interval(0.9999, 20_000, share)
        assert low <= copies[count] <= high


def test_delays_fill_the_interval_that_was_said() -> None:
    times = [t for one in arrivals(Network(delay_us=5_000, jitter_us=3_000)) for t in one]
    assert (min(times), max(times)) == (1_005_000, 1_008_000)
    assert np.mean(times) == pytest.approx(1_006_500, abs=50)


def test_the_seed_decides() -> None:
    network = Network(loss=0.3, duplicate=0.3)
    assert arrivals(network, 200, seed=1) == arrivals(network, 200, seed=1)
    assert arrivals(network, 200, seed=1) != arrivals(network, 200, seed=2)


@pytest.mark.parametrize("ppm", [-50.0, 0.0, 50.0])
def test_a_clock_can_be_read_backwards(ppm: float) -> None:
    clock = Clock(7_200_000_000, ppm)
    for t in (0, 1, 999_999, 60_000_000, 3_600_000_000):
        assert clock.world(clock.local(t)) in (t, t - 1)
        assert clock.local(clock.world(clock.local(t))) >= clock.local(t)
    gone = clock.local(1_000_000_000) - clock.local(0)
    assert gone - 1_000_000_000 == round(ppm * 1_000)


class Ears:
    """A simulated team without sensors, and what each robot was handed."""

    def __init__(self, network: Network, robots: int = 2, seed: int = 0) -> None:
        self.simulator = Simulator(seed, network)
        self.heard: dict[int, list[tuple[int, str]]] = {}
        for robot in range(robots):
            member = self.simulator.add(parse(TOML.format(robot)), Clock(robot * 10**9, 20.0))
            self._listen(member)

    def _listen(self, member: Member) -> None:
        robot, handle = member.robot, member.robot.handle
        heard = self.heard[robot.own.robot] = []

        def listening(event: Event) -> object:
            if isinstance(event, Datagram):
                heard.append((event.utime, event.sender))
            return handle(event)

        robot.handle = listening  # type: ignore[method-assign, assignment]


def statuses(ears: Ears, robot: int) -> list[int]:
    sent = ears.simulator.members[robot].traces.sent
    return [t for t, channel, _ in sent if messages.kind_of_channel(channel) == "STATUS"]


def test_what_one_sends_all_others_hear_after_the_delay_on_their_own_clocks() -> None:
    ears = Ears(Network(delay_us=5_000, jitter_us=0), robots=3)
    ears.simulator.run(3.5)
    sent = [t for t, _, _ in ears.simulator.members[0].traces.sent]
    assert len(statuses(ears, 0)) == 4
    for robot in (1, 2):
        clock = ears.simulator.members[robot].clock
        assert [u for u, who in ears.heard[robot] if who == "robot 0"] == [
            clock.local(t + 5_000) for t in sent
        ]
    assert all(who != "robot 0" for _, who in ears.heard[0])


def test_a_link_that_is_cut_carries_nothing_one_way_and_everything_the_other() -> None:
    ears = Ears(Network(connected=lambda a, b, t: (a, b) != (0, 1) or t > 2_500_000))
    ears.simulator.run(4.5)
    clock = ears.simulator.members[1].clock
    first = min(u for u, who in ears.heard[1] if who == "robot 0")
    assert clock.world(first) > 2_500_000
    assert clock.world(first) < 3_200_000
    assert len(ears.heard[0]) >= 4


def test_a_robot_that_was_killed_says_and_hears_nothing_and_one_that_stops_says_goodbye() -> None:
    ears = Ears(Network(), robots=3)
    ears.simulator.run(2.2)
    one, other = ears.simulator.members[1], ears.simulator.members[2]
    said = len(one.traces.sent)
    ears.simulator.kill(one)
    heard = len(ears.heard[1])
    ears.simulator.stop(other)
    assert len(other.traces.saved) == 1
    ears.simulator.run(2.5)
    still_there = ears.simulator.members[0]
    assert set(still_there.robot.team.living(still_there.clock.local(2_500_000))) == {1}
    ears.simulator.run(5.0)
    assert len(one.traces.sent) == said
    assert len(ears.heard[1]) == heard


def test_two_runs_with_one_seed_are_the_same_and_with_another_they_are_not() -> None:
    def run(seed: int) -> list[tuple[int, str]]:
        ears = Ears(Network(loss=0.3, duplicate=0.3, jitter_us=50_000), seed=seed)
        ears.simulator.run(10.0)
        return ears.heard[0]

    assert run(1) == run(1)
    assert run(1) != run(2)
