"""Frames and ranges that break with those before wait until the next ones say the same."""

from __future__ import annotations

import pytest
from frames import SECOND_US, Peer, node_frame2, node_frame3

from drslamd.sensors.linktrack.codec import Refusal
from drslamd.sensors.linktrack.linktrack_input import LinkTrackInput, RangeRefusal

OWN, MS = 5, 1000


class Module:
    """Prints a frame every 20 ms with a peer 3 m away; what is said of one frame may be other."""

    def __init__(self) -> None:
        self.uwb = LinkTrackInput(OWN, max_range_m=120.0)
        self.ms = 0
        for _ in range(10):
            self.prints()

    def prints(
        self, *peers: Peer, system_ms: int = 0, millivolts: int = 4939, role: int = 0
    ) -> list[float]:
        """Ranges that are believed now."""
        self.ms += 20
        frame = node_frame3(
            OWN,
            peers or [Peer(9, 3000)],
            local_ms=self.ms,
            system_ms=self.ms + 17 + system_ms,
            millivolts=millivolts,
            role=role,
        )
        return [s.range_m for s in self.uwb.feed(frame, 100 * SECOND_US + self.ms * MS)]


@pytest.mark.row("D2")
@pytest.mark.parametrize(
    ("inside", "outside"),
    [
        ({"millivolts": 4939 + 299}, {"millivolts": 4939 + 301}),
        ({"system_ms": 10}, {"system_ms": 11}),
        ({"system_ms": -10}, {"system_ms": -11}),
        ({"role": 0}, {"role": 1}),
    ],
)
def test_a_frame_that_breaks_with_the_one_before_waits(
    inside: dict[str, int], outside: dict[str, int]
) -> None:
    assert Module().prints(**inside) == [3.0]
    module = Module()
    assert module.prints(**outside) == []
    assert module.uwb.frames.refused[Refusal.STEP] == 1
    assert module.prints() == [3.0]


@pytest.mark.parametrize("change", [{"millivolts": 4400}, {"system_ms": 90}, {"role": 1}])
def test_what_has_changed_in_truth_costs_one_frame(change: dict[str, int]) -> None:
    module = Module()
    assert [bool(module.prints(**change)) for _ in range(5)] == [False, *[True] * 4]


def test_a_byte_that_changed_once_is_not_looked_at_again() -> None:
    module = Module()
    for role in (1, 1):
        module.prints(role=role)
    assert [bool(module.prints(role=role)) for role in (2, 3, 4)] == [True] * 3


def test_a_module_whose_frames_never_agree_is_believed_at_every_third() -> None:
    module = Module()
    jumps = [bool(module.prints(millivolts=3400 + 400 * (k % 6))) for k in range(1, 10)]
    assert jumps[2::3] == [True] * 3


@pytest.mark.row("D2")
@pytest.mark.parametrize(
    ("inside", "outside"),
    [
        (Peer(9, 3699), Peer(9, 3701)),  # half a metre, and 10 m/s for 20 ms
        (Peer(9, 3000, 163 + 40), Peer(9, 3000, 163 + 41)),
        (Peer(9, 3000, 163, 155 - 40), Peer(9, 3000, 163, 155 - 41)),
        (Peer(9, 3000, role=0), Peer(9, 3000, role=64)),
    ],
)
def test_a_range_that_breaks_with_the_one_before_waits(inside: Peer, outside: Peer) -> None:
    def module() -> Module:
        built = Module()
        built.prints(Peer(9, 3000, 163, 155))
        return built

    assert len(module().prints(inside)) == 1
    strange = module()
    assert strange.prints(outside) == []
    assert strange.uwb.ranges.refused[RangeRefusal.STEP] == 1
    assert strange.prints() == [3.0]


def test_a_range_that_has_changed_in_truth_costs_one() -> None:
    module = Module()
    assert [module.prints(Peer(9, 8000)) for _ in range(3)] == [[], [8.0], [8.0]]


def test_the_ranges_to_others_in_a_frame_with_a_step_are_believed() -> None:
    module = Module()
    module.prints(Peer(9, 3000), Peer(4, 2000))
    assert module.prints(Peer(9, 8000), Peer(4, 2010)) == [2.01]


@pytest.mark.parametrize(("frames", "is_believed"), [(90, True), (92, False)])
def test_a_peer_that_appears_late_is_believed_at_its_second_range(
    frames: int, is_believed: bool
) -> None:
    """A module names all that it hears in its first two seconds."""
    module = Module()
    for _ in range(frames):
        module.prints()
    assert bool(module.prints(Peer(4, 2000))) is is_believed
    assert module.prints(Peer(4, 2000)) == [2.0]


def test_after_a_second_of_silence_any_frame_is_believed() -> None:
    for silence_ms, is_believed in ((980, False), (981, True)):
        module = Module()
        module.ms += silence_ms
        assert bool(module.prints(role=1)) is is_believed


@pytest.mark.parametrize(("every_s", "believed"), [(2.5, 7), (9.9, 7), (10.1, 0)])
def test_who_is_heard_now_and_then_is_believed_but_for_the_first_time(
    every_s: float, believed: int
) -> None:
    """Another peer is heard in every frame."""
    module, came = Module(), []
    for k in range(1, round(8 * every_s * 50) + 1):
        is_heard = k % round(every_s * 50) == 0
        found = module.prints(Peer(9, 3000), *([Peer(4, 4000 + 2 * k)] if is_heard else []))
        came += [metres for metres in found if metres != 3.0]
    assert len(came) == believed


@pytest.mark.parametrize(("age_ms", "is_believed"), [(250, True), (251, False)])
def test_an_entry_that_was_measured_long_ago_of_a_sudden_waits(
    age_ms: int, is_believed: bool
) -> None:
    uwb, came = LinkTrackInput(OWN, max_range_m=120.0), []
    for k in range(6):
        old = age_ms if k == 5 else 0
        peer = Peer(9, 3000, system_ms=1000 + 20 * k - old)
        frame = node_frame2(OWN, [peer], local_ms=2000 + 20 * k, system_ms=1000 + 20 * k)
        came = uwb.feed(frame, 100 * SECOND_US + 20 * k * MS)
    assert bool(came) is is_believed
