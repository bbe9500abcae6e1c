"""From the bytes of a module to ranges that may be believed."""

from __future__ import annotations

import random
from collections.abc import Callable

import pytest
from frames import (
    SECOND_US,
    Peer,
    anchor_frame0,
    aoa_node_frame0,
    cut,
    error_frame0,
    node_frame0,
    node_frame1,
    node_frame2,
    node_frame3,
    node_frame4,
    node_frame5,
    ranging_stream,
    setting_frame0,
    system_common_frame0,
    tag_frame0,
    with_length,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from drslamd.sensors.linktrack.codec import Refusal
from drslamd.sensors.linktrack.linktrack_frames import ModuleFault
from drslamd.sensors.linktrack.linktrack_input import (
    SYSTEM_TIME_PERIOD_US,
    LinkTrackInput,
    RangeRefusal,
)
from drslamd.sensors.samples import RangeSample

MS = 1000
OWN = 5
T0 = 100 * SECOND_US
LONG_OWN = 0xBE23BE6B


def an_input(uwb_id: int = OWN) -> LinkTrackInput:
    return LinkTrackInput(uwb_id, max_range_m=120.0)


def trusting(uwb_id: int = OWN, role: int = 0, millivolts: int = 4939) -> LinkTrackInput:
    """An input whose module has just been believed: local time 1000 ms at T0."""
    uwb = an_input(uwb_id)
    for local_ms in (980, 1000):
        frame = node_frame3(
            uwb_id, local_ms=local_ms, system_ms=local_ms + 17, role=role, millivolts=millivolts
        )
        assert uwb.feed(frame, T0 + (local_ms - 1000) * MS) == []
    assert (uwb.frames.accepted, uwb.frames.refused.total()) == (1, 1)
    return uwb


def one_frame(uwb: LinkTrackInput, *peers: Peer) -> list[RangeSample]:
    """What the next frame, 20 ms later, gives."""
    return uwb.feed(node_frame3(OWN, peers, local_ms=1020, system_ms=1037), T0 + 20 * MS)


# which frames are believed


def test_the_first_frame_gives_no_range_the_second_does() -> None:
    uwb = an_input()
    first, second = ranging_stream(2)
    assert uwb.feed(first, T0) == []
    (sample,) = uwb.feed(second, T0 + 20 * MS)
    assert sample == RangeSample(T0 + 20 * MS, 10, 1.001, 4.0)
    assert (uwb.frames.accepted, uwb.frames.refused) == (1, {Refusal.TIME: 1})
    assert (uwb.last_good_utime, uwb.voltage_v) == (T0 + 20 * MS, 4.939)


@pytest.mark.parametrize("build", [node_frame2, node_frame3])
def test_both_frames_of_dr_mode0_give_ranges(build: Callable[..., bytes]) -> None:
    uwb = an_input()
    uwb.feed(build(OWN, [Peer(9, 1500)], local_ms=1000, system_ms=900), T0)
    samples = uwb.feed(build(OWN, [Peer(9, 1502)], local_ms=1020, system_ms=920), T0 + 20 * MS)
    assert [(s.peer_uwb_id, s.range_m) for s in samples] == [(9, 1.502)]


def test_the_frame_of_dr_mode1_gives_ranges_under_long_ids() -> None:
    uwb = an_input(LONG_OWN)
    peers = [Peer(0xBEF2BE32, 300), Peer(0xFF, 193), Peer(0xFFFFFFFF, 200)]
    uwb.feed(node_frame5(LONG_OWN, peers, local_ms=1000), T0)
    samples = uwb.feed(node_frame5(LONG_OWN, peers, local_ms=1020), T0 + 20 * MS)
    assert [s.peer_uwb_id for s in samples] == [0xBEF2BE32, 0xFF, 0xFFFFFFFF]


@pytest.mark.parametrize("role", [0, 1, 2, 7, 200, 254, 255])
def test_no_role_is_a_reason_to_refuse(role: int) -> None:
    uwb = trusting(role=role)
    frame = node_frame3(OWN, [Peer(9, 1500, role=role)], local_ms=1020, role=role)
    assert len(uwb.feed(frame, T0 + 20 * MS)) == 1


@pytest.mark.parametrize("seen", [3, 255])
def test_frames_of_another_id_give_no_range_and_the_id_is_reported(seen: int) -> None:
    uwb = an_input()
    assert uwb.feed(b"".join(ranging_stream(5, own_id=seen)), T0) == []
    assert uwb.frames.refused == {Refusal.WRONG_ID: 5}
    assert uwb.foreign_id == seen
    assert uwb.last_good_utime is None


@pytest.mark.parametrize(
    ("millivolts", "believed"), [(3299, False), (3300, True), (6000, True), (6001, False)]
)
def test_a_module_lives_on_3_3_to_6_volts(millivolts: int, believed: bool) -> None:
    uwb = trusting(millivolts=min(max(millivolts, 3300), 6000))
    frame = node_frame3(OWN, [Peer(9, 1500)], local_ms=1020, millivolts=millivolts)
    assert len(uwb.feed(frame, T0 + 20 * MS)) == believed
    assert uwb.frames.refused[Refusal.VOLTAGE] == (not believed)


def test_a_refused_frame_leaves_no_trace_but_its_count() -> None:
    uwb = trusting()
    before = (uwb.last_good_utime, uwb.voltage_v, uwb.system_offset_us(T0))
    for frame in (
        node_frame3(OWN, [Peer(9, 1500)], local_ms=1020, millivolts=9000),
        node_frame3(OWN + 1, [Peer(9, 1500)], local_ms=1020),
        node_frame3(OWN, [Peer(9, 1500)], local_ms=99_000_000),
    ):
        assert uwb.feed(frame, T0 + MS) == []
    assert (uwb.last_good_utime, uwb.voltage_v, uwb.system_offset_us(T0)) == before
    assert uwb.ranges.received == 0
    assert len(one_frame(uwb, Peer(9, 1500))) == 1


@pytest.mark.row("D11")
def test_a_restarted_module_is_believed_at_its_second_frame() -> None:
    uwb = trusting()
    for k, local_ms in enumerate((4, 24, 44)):
        frame = node_frame3(OWN, [Peer(9, 1500)], local_ms=local_ms)
        assert len(uwb.feed(frame, T0 + SECOND_US + k * 20 * MS)) == (k > 0)
    assert uwb.counters()["module_restarts"] == 1


@pytest.mark.row("D10")
def test_ranges_go_on_over_the_wrap_of_both_clocks() -> None:
    uwb = an_input()
    start_ms = (1 << 32) - 90
    samples = []
    for k, frame in enumerate(ranging_stream(10, start_ms=start_ms)):
        samples += uwb.feed(frame, T0 + k * 20 * MS)
        offset = uwb.system_offset_us(T0 + k * 20 * MS)
        if k > 1:
            assert offset is not None
            expected = T0 - (start_ms + 17) * MS
            assert (offset - expected) % SYSTEM_TIME_PERIOD_US == 0
    assert [s.utime for s in samples] == [T0 + k * 20 * MS for k in range(1, 10)]


# which ranges are believed


@pytest.mark.parametrize(
    ("millimetres", "kept"),
    [(-501, False), (-500, True), (-1, True), (0, True), (120_000, True), (120_001, False)],
)
def test_distances_have_limits(millimetres: int, kept: bool) -> None:
    uwb = trusting()
    samples = one_frame(uwb, Peer(9, millimetres))
    assert [s.range_m for s in samples] == ([millimetres / 1000] if kept else [])
    assert uwb.ranges.refused[RangeRefusal.LIMITS] == (not kept)


def test_entry_255_is_skipped() -> None:
    uwb = trusting()
    assert [s.peer_uwb_id for s in one_frame(uwb, Peer(255, 777), Peer(9, 1500))] == [9]
    assert uwb.ranges.refused == {RangeRefusal.EMPTY: 1}


def test_there_is_no_range_to_itself() -> None:
    uwb = trusting()
    assert one_frame(uwb, Peer(OWN, 777)) == []
    assert uwb.ranges.refused == {RangeRefusal.SELF: 1}


def test_several_entries_of_one_peer_become_their_median() -> None:
    uwb = trusting()
    peers = [Peer(3, d, fp, 155) for d, fp in ((1500, 163), (9000, 171), (1498, 164))]
    first, second = one_frame(uwb, peers[0], Peer(4, 2000), *peers[1:])
    assert (first.peer_uwb_id, first.range_m, first.power_gap_db) == (3, 1.5, 4.5)
    assert (second.peer_uwb_id, second.range_m) == (4, 2.0)
    assert uwb.ranges.refused == {RangeRefusal.DUPLICATE: 2}


def frames_with(uwb: LinkTrackInput, count: int, role: int, *peers: Peer) -> str | None:
    """What is advised after so many frames with these partners."""
    for k in range(count):
        ms = 1020 + 20 * k
        frame = node_frame3(OWN, peers, local_ms=ms, system_ms=ms + 17, role=role)
        uwb.feed(frame, T0 + (ms - 1000) * MS)
    return uwb.advice(T0 + 20 * count * MS)


@pytest.mark.parametrize(
    ("role", "peers", "sentence"),
    [
        (2, [Peer(0, 1500, role=1), Peer(1, 2000, role=1)], "as in the LP modes"),
        (2, [Peer(0, 1500, role=1), Peer(1, 2000, role=0)], None),
        (0, [Peer(0, 1500, role=1)], None),
        (2, [], None),
        (0, [Peer(OWN, 1500)], "another UWB module has id 5, too"),
        (0, [Peer(3, 1500), Peer(3, 4501)], "two UWB modules have id 3"),
        (0, [Peer(3, 1500), Peer(3, 4500)], None),
        (0, [Peer(255, 0), Peer(255, 9000)], None),
    ],
)
def test_roles_and_ids_that_should_not_be_are_named(
    role: int, peers: list[Peer], sentence: str | None
) -> None:
    said = frames_with(trusting(role=role), 3, role, *peers)
    assert sentence in said if said and sentence else said is sentence


def test_two_odd_frames_are_no_finding_yet() -> None:
    assert frames_with(trusting(), 2, 0, Peer(OWN, 1500)) is None


def test_the_power_gap_is_received_minus_first_path() -> None:
    (sample,) = one_frame(trusting(), Peer(9, 1500, fp=180, rx=158))
    assert sample.power_gap_db == 11.0


# time


def test_a_range_is_stamped_when_it_was_measured_not_when_it_came() -> None:
    uwb = trusting()
    frame = node_frame3(OWN, [Peer(9, 1500)], local_ms=1020)
    (sample,) = uwb.feed(frame, T0 + 170 * MS)
    assert sample.utime == T0 + 20 * MS


def test_the_system_offset_leads_every_robot_to_the_same_time() -> None:
    one, other = an_input(1), an_input(2)
    for k in range(50):  # both hosts and modules have clocks of their own, system_time is shared
        true_us, system_ms = k * 20 * MS, 700_000 + k * 20
        one.feed(node_frame3(1, local_ms=5_000 + k * 20, system_ms=system_ms), T0 + true_us)
        other.feed(node_frame3(2, local_ms=9_000 + k * 20, system_ms=system_ms), 3 * T0 + true_us)
    offset_one, offset_other = one.system_offset_us(T0 + true_us), other.system_offset_us(3 * T0)
    assert offset_one is not None
    assert offset_other is not None
    assert T0 - offset_one == 3 * T0 - offset_other == 700_000 * MS


def test_without_a_confirmed_frame_there_is_no_system_offset() -> None:
    uwb = an_input()
    assert uwb.system_offset_us(T0) is None
    offsets = []
    for k, frame in enumerate(ranging_stream(3)):
        uwb.feed(frame, T0 + k * 20 * MS)
        offsets.append(uwb.system_offset_us(T0 + k * 20 * MS))
    assert offsets == [None, None, T0 - 1017 * MS]


@pytest.mark.parametrize(("jump_ms", "kept"), [(10, True), (-10, True), (11, False), (-11, False)])
def test_a_jump_of_the_system_time_hides_the_offset_for_one_frame(jump_ms: int, kept: bool) -> None:
    uwb = trusting()
    one_frame(uwb)
    offsets = []
    for k in (2, 3):
        now = T0 + k * 20 * MS
        system_ms = 1017 + k * 20 + jump_ms
        uwb.feed(node_frame3(OWN, local_ms=1000 + k * 20, system_ms=system_ms), now)
        offsets.append(uwb.system_offset_us(now))
    moved = T0 - 1017 * MS - jump_ms * MS
    assert offsets == [moved if kept else None, moved]


@pytest.mark.parametrize(("age", "known"), [(4 * SECOND_US, True), (4 * SECOND_US + 1, False)])
def test_the_system_offset_grows_too_old(age: int, known: bool) -> None:
    uwb = trusting()
    one_frame(uwb)
    assert (uwb.system_offset_us(T0 + 20 * MS + age) is not None) == known


@pytest.mark.parametrize("period_ms", [5, 20])
def test_dr_mode1_has_no_system_time(period_ms: int) -> None:
    uwb = an_input(LONG_OWN)
    for k in range(5):
        now_ms = k * period_ms
        uwb.feed(node_frame5(LONG_OWN, local_ms=1000 + now_ms), T0 + now_ms * MS)
        assert uwb.system_offset_us(T0 + now_ms * MS) is None


# bookkeeping


def test_every_frame_and_every_entry_ends_in_exactly_one_count() -> None:
    uwb = an_input()
    draw = random.Random(3)
    kinds = [
        node_frame3(OWN + 1),
        node_frame3(OWN, millivolts=100),
        node_frame0(OWN, [(1, b"x")]),
        error_frame0(1),
        setting_frame0(),
        system_common_frame0(),
        tag_frame0(),
        anchor_frame0([]),
        node_frame1([]),
        node_frame4([]),
        aoa_node_frame0([]),
        with_length(b"\x55\x0b", bytes(20)),
        with_length(b"\x55\x02", bytes([0, 5, 0, 0, 0, 0, 1, 0, 9, 9, 0])),
    ]
    entries = 0
    for k in range(300):
        if k % 3:
            peers = [Peer(draw.choice([1, 2, 3, OWN, 255]), draw.randint(-900, 130_000))] * 2
            before = uwb.frames.accepted
            uwb.feed(node_frame3(OWN, peers, local_ms=1000 + k * 20), T0 + k * 20 * MS)
            entries += 2 * (uwb.frames.accepted - before)
        else:
            uwb.feed(draw.choice(kinds), T0 + k * 20 * MS)
    assert uwb.frames.received == 300
    assert uwb.ranges.received == entries > 300
    assert uwb.counters()["frames.refused.WRONG_ID"] == uwb.frames.refused[Refusal.WRONG_ID]


@pytest.mark.parametrize(
    ("frame", "reason"),
    [
        (anchor_frame0([]), Refusal.LP_MODE),
        (tag_frame0(), Refusal.LP_MODE),
        (node_frame1([]), Refusal.LP_MODE),
        (node_frame4([]), Refusal.LP_MODE),
        (aoa_node_frame0([]), Refusal.UNKNOWN_KIND),
        (with_length(b"\x55\x0b", bytes(20)), Refusal.UNKNOWN_KIND),
        (with_length(b"\x55\x02", bytes([0, 5, 0, 0, 0, 0, 1, 0, 9, 9, 0])), Refusal.ENTRIES),
    ],
)
def test_frames_that_can_give_no_range_are_refused_for_their_reason(
    frame: bytes, reason: Refusal
) -> None:
    uwb = trusting()
    assert uwb.feed(frame, T0 + MS) == []
    assert uwb.frames.refused == {Refusal.TIME: 1, reason: 1}
    assert (uwb.wrong_mode is not None) == (reason is Refusal.LP_MODE)


def test_user_data_settings_and_versions_are_ignored() -> None:
    uwb = trusting()
    uwb.feed(node_frame0(OWN, [(1, b"x")]) + setting_frame0() + system_common_frame0(), T0 + MS)
    assert uwb.frames.ignored == 3


def test_the_faults_of_the_module_are_kept_by_name() -> None:
    uwb = trusting()
    uwb.feed(error_frame0(0xFF), T0 + MS)
    assert uwb.module_faults == (
        ModuleFault.DUPLICATE_ID
        | ModuleFault.RESTART
        | ModuleFault.HARDWARE
        | ModuleFault.UWB_TRANSMIT
        | ModuleFault.USER_DATA_TOO_LONG
    )
    uwb.feed(error_frame0(0b0100_0110), T0 + 2 * MS)
    assert uwb.module_faults == ModuleFault(0)


def test_counters_have_flat_names() -> None:
    uwb = trusting()
    one_frame(uwb, Peer(9, 1500), Peer(255, 0))
    uwb.feed(b"noise", T0 + 30 * MS)
    assert uwb.counters() == {
        "bytes": 2 * 22 + 36 + 5,
        "garbage_bytes": 5,
        "bad_checksums": 0,
        "module_restarts": 0,
        "frames.accepted": 2,
        "frames.ignored": 0,
        "frames.refused.TIME": 1,
        "ranges.accepted": 1,
        "ranges.ignored": 0,
        "ranges.refused.EMPTY": 1,
    }


# noise and damage


def outcome(reads: list[bytes]) -> tuple[object, ...]:
    uwb = an_input()
    samples = [sample for read in reads for sample in uwb.feed(read, T0)]
    return samples, uwb.counters(), uwb.advice(T0), uwb.foreign_id, uwb.wrong_mode


@pytest.mark.row("D4")
@pytest.mark.parametrize("seed", range(10))
def test_whole_and_byte_by_byte_and_random_reads_give_the_same(seed: int) -> None:
    draw = random.Random(seed)
    parts = [*ranging_stream(60, peers=3), tag_frame0(), b"$GPGGA,1,2\r\n" * 4, error_frame0(9)]
    parts += [draw.randbytes(draw.randint(1, 30)) for _ in range(30)]
    draw.shuffle(parts)
    stream = b"".join(parts)
    whole = outcome([stream])
    assert outcome([stream[i : i + 1] for i in range(len(stream))]) == whole
    assert outcome(list(cut(stream, seed))) == whole


@pytest.mark.row("D3")
def test_one_poisoned_byte_costs_no_range() -> None:
    for value in range(256):
        uwb = trusting()
        frame = node_frame3(OWN, [Peer(9, 1500)], local_ms=1020)
        assert len(uwb.feed(bytes([value]) + frame, T0 + 20 * MS)) == 1, value


@pytest.mark.row("D1")
def test_a_million_random_bytes_give_no_range() -> None:
    uwb = an_input()
    noise = random.Random(1).randbytes(1_000_000)
    for start in range(0, len(noise), 1843):  # 20 ms at 921600 baud
        assert uwb.feed(noise[start : start + 1843], T0 + start * 11) == []
    assert uwb.frames.accepted == 0


@pytest.mark.row("D1")
def test_random_bytes_with_right_sums_give_no_range() -> None:
    draw = random.Random(2)
    uwb = trusting()
    for k in range(20_000):
        frame = bytearray(node_frame3(draw.randrange(256), [Peer(1, 0)]))
        frame[4:20] = draw.randbytes(16)
        frame[21:28] = draw.randbytes(7)
        frame[-1] = sum(frame[:-1]) & 0xFF
        assert uwb.feed(bytes(frame), T0 + k * 20 * MS) == []
    assert uwb.frames.received == 20_002


@pytest.mark.row("D2")
@settings(derandomize=True, max_examples=200, deadline=None)
@given(st.integers(0, 28), st.integers(0, 7), st.integers(0, 28), st.integers(0, 7))
def test_bit_flips_never_raise_and_good_frames_go_on(a: int, x: int, b: int, y: int) -> None:
    uwb = trusting()
    damaged = bytearray(node_frame3(OWN, [Peer(9, 1500)], local_ms=1020))
    damaged[a] ^= 1 << x
    damaged[b] ^= 1 << y
    uwb.feed(bytes(damaged), T0 + 20 * MS)
    samples = []
    for k in range(2, 40):  # more than the 1024 bytes that an unknown kind may announce
        frame = node_frame3(OWN, [Peer(9, 1500)], local_ms=1000 + k * 20)
        samples += uwb.feed(frame, T0 + k * 20 * MS)
    assert samples[-1].range_m == 1.5


def test_a_frame_torn_at_any_place_costs_only_itself() -> None:
    for end in range(1, 29):
        uwb = trusting()
        torn = node_frame3(OWN, [Peer(9, 1500)], local_ms=1020)[:end]
        uwb.feed(torn, T0 + 20 * MS)
        samples = []
        for k in range(2, 5):  # the cable was out for ten seconds
            frame = node_frame3(OWN, [Peer(9, 1600)], local_ms=11_000 + k * 20)
            samples += uwb.feed(frame, T0 + 10 * SECOND_US + k * 20 * MS)
        assert [s.range_m for s in samples] == [1.6] * 3
