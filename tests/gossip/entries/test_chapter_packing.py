"""Chapters as bytes: what is packed comes back, and nothing else is taken for a chapter."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest
from message_builders import CORRECTED, COVARIANCE

from drslamd.conventions import Chain, node_chain
from drslamd.gossip.entries import number_tables
from drslamd.gossip.entries.chapter_packing import numbers_in, packed, unpacked
from drslamd.slam.graph.measurements import (
    Chapter,
    ClosureMeasurement,
    Keyframe,
    Placed,
    RangeMeasurement,
)
from drslamd.slam.odometry.gyro_noise import OPEN, GyroNoise
from drslamd.slam.robot_model import UNTOLD

TURNED = replace(UNTOLD, noise=replace(UNTOLD.noise, gyro=GyroNoise(0.25, 0.5, 70_000, OPEN)))
A, B = Chain(4, 12), Chain(7, 2**62)
SEQ = 70


def ranged(n: int, peer: Chain, metres: float) -> RangeMeasurement:
    return RangeMeasurement(n, peer, n + 3, (0.125, -0.5), (0.25, 0.0), metres, 0.125, 0.25, -0.5)


def seen(number: int, peer: Chain, *, kept: bool = True) -> ClosureMeasurement:
    pose = (1.5, -2.5, 0.25)
    return ClosureMeasurement(number, kept, 40, peer, 41, pose, COVARIANCE, CORRECTED)


def place(seq: int, at: int = 0) -> int:
    return 4096 * seq + at


SAMPLE = Chapter(
    parts=4,
    replaces=((3, 40), (42, 66)),
    models=((5, UNTOLD), (9, TURNED)),
    keyframes=(Keyframe(10, 0, -(2**31), 2**31 - 1, 5), Keyframe(2**31 - 2, 9, 0, -1, -7)),
    ranges=((place(5), ranged(40, A, 3.5)), (place(5, 1), ranged(40, A, 2.25)),
            (place(4), ranged(40, B, -1.5))),
    closures=((place(9), seen(8, A)), (place(9, 1), seen(8, A, kept=False))),
)  # fmt: skip


def is_close(one: Chapter, other: Chapter) -> bool:
    """The same but for sigmas of odometry, which travel as 32-bit numbers."""
    return replace(one, models=()) == replace(other, models=()) and all(
        a == b and m.numbers() == pytest.approx(n.numbers())
        for (a, m), (b, n) in zip(one.models, other.models, strict=True)
    )


def test_what_is_packed_comes_back() -> None:
    assert is_close(unpacked(packed(SAMPLE), SEQ), SAMPLE)
    nothing = Chapter(0)
    assert unpacked(packed(nothing), SEQ) == nothing


def test_modules_that_no_robot_carries_are_peers_like_others() -> None:
    node = node_chain(77)
    ranges = (*SAMPLE.ranges, (place(6), ranged(40, node, 2.0)))
    chapter = replace(SAMPLE, ranges=ranges)
    assert unpacked(packed(chapter), SEQ).ranges == ranges


def test_what_came_back_is_packed_to_the_same_bytes() -> None:
    assert packed(unpacked(packed(SAMPLE), SEQ)) == packed(SAMPLE)


@pytest.mark.parametrize(
    ("seq", "fits"), [(5 + 32_768, True), (5 + 32_769, False), (5, True), (4, False)]
)
def test_a_chapter_speaks_of_nothing_that_lies_far_behind_it_or_ahead(seq: int, fits: bool) -> None:
    data = packed(Chapter(0, (), ((5, UNTOLD),)))
    if fits:
        assert unpacked(data, seq).models[0][0] == 5
        return
    with pytest.raises(ValueError, match="entry"):
        unpacked(data, seq)


def test_a_chapter_names_the_first_entry_that_it_speaks_of_as_such() -> None:
    data = bytearray(packed(Chapter(0, (), ((5, UNTOLD),))))
    assert data[2:6] == (5).to_bytes(4, "big")
    data[2:6] = (4).to_bytes(4, "big")
    with pytest.raises(ValueError, match="not its first"):
        unpacked(bytes(data), SEQ)


def test_a_chapter_stands_for_sixty_four_stretches_of_entries_at_most() -> None:
    spans = tuple((3 * k, 3 * k + 2) for k in range(64))
    said = Chapter(1, spans)
    assert unpacked(packed(said), 200) == said
    with pytest.raises(ValueError, match="spans"):
        unpacked(packed(Chapter(1, (*spans, (192, 193)))), 200)


@pytest.mark.parametrize(
    "wrong",
    [
        replace(SAMPLE, parts=-1),
        replace(SAMPLE, parts=0),
        replace(SAMPLE, parts=6),
        replace(SAMPLE, replaces=()),
        replace(SAMPLE, replaces=((3, 40), (40, 66))),
        replace(SAMPLE, replaces=((3, 3),)),
        replace(SAMPLE, replaces=((3, 68),)),
        replace(SAMPLE, replaces=tuple((3 + k, 4 + k) for k in range(0, 130, 2)), parts=1),
        replace(SAMPLE, models=((71, UNTOLD),)),
        replace(SAMPLE, ranges=((place(71), ranged(40, A, 3.5)),)),
        replace(SAMPLE, ranges=SAMPLE.ranges[1::-1]),
        replace(SAMPLE, ranges=SAMPLE.ranges[:1] * 2),
        replace(SAMPLE, ranges=((place(5), ranged(-1, A, 3.5)),)),
        replace(SAMPLE, ranges=((place(5), ranged(40, A, 10_000.5)),)),
        replace(SAMPLE, ranges=((place(5), replace(ranged(40, A, 1.0), q_a=(32.8, 0.0))),)),
        replace(SAMPLE, keyframes=(Keyframe(10, 2**15, 0, 0, 0),)),
        replace(SAMPLE, closures=((place(9), replace(seen(8, A), covariance=(0.0,) * 6)),)),
    ],
)
def test_what_no_robot_could_have_packed_is_refused(wrong: Chapter) -> None:
    assert not is_close(wrong, SAMPLE)
    with pytest.raises(ValueError):
        unpacked(packed(wrong), SEQ)


def test_parts_lie_behind_all_that_the_chapter_stands_for() -> None:
    assert unpacked(packed(replace(SAMPLE, parts=5)), SEQ).parts == 5


def test_bytes_that_end_elsewhere_are_refused() -> None:
    data = packed(SAMPLE)
    for wrong in (b"", data + b"x", *(data[:size] for size in range(len(data)))):
        with pytest.raises((ValueError, IndexError)):
            unpacked(wrong, SEQ)


def test_few_bytes_cannot_hold_many_numbers() -> None:
    """Columns that step evenly cost nothing."""
    said = Chapter(0, (), (), tuple(Keyframe(k, 0, 0, 0, 0) for k in range(3_277)))
    assert numbers_in(said) == number_tables.MAX_NUMBERS + 1
    assert len(packed(said)) < 100
    with pytest.raises(ValueError, match="more than"):
        unpacked(packed(said), SEQ)
    fewer = replace(said, keyframes=said.keyframes[1:])
    assert unpacked(packed(fewer), SEQ) == fewer


def test_peers_are_named_in_order_and_have_something_said_of_them() -> None:
    data = packed(SAMPLE)
    head, peer = data[:20], [data[20:34], data[34:48]]
    rest = data[48:]
    assert head + b"".join(peer) + rest == data
    swapped = head + peer[1] + peer[0] + rest
    with pytest.raises(ValueError, match="out of order"):
        unpacked(swapped, SEQ)
    nothing = peer[1][:-4] + bytes(4)
    with pytest.raises(ValueError, match="nothing is said"):
        unpacked(head + peer[0] + nothing + rest, SEQ)


def test_damaged_bytes_give_a_chapter_or_a_value_error_and_nothing_else() -> None:
    chance, data = random.Random(1), packed(SAMPLE)
    read = 0
    for _ in range(300):
        damaged = bytearray(data)
        for _ in range(chance.randrange(1, 4)):
            damaged[chance.randrange(len(damaged))] ^= 1 << chance.randrange(8)
        try:
            found = unpacked(bytes(damaged), SEQ)
        except (ValueError, IndexError):
            continue
        read += 1
        assert packed(unpacked(packed(found), SEQ)) == packed(found)
    assert read >= 5


def test_a_minute_of_driving_has_an_eighth_of_the_bytes_of_its_entries() -> None:
    """As 60 entries: 70 bytes of each, and 54 for each of two ranges."""
    chance = random.Random(2)
    frames, ranges = list[Keyframe](), list[Placed[RangeMeasurement]]()
    for k in range(60):
        step = (round(chance.gauss(4_000, 300)), round(chance.gauss(0, 300)), 50)
        last = frames[-1] if frames else Keyframe(0, 0, 0, 0, 0)
        frames.append(Keyframe(10 * k, 0, last.x + step[0], last.y + step[1], last.theta + step[2]))
        near = round(5 + 0.1 * k + chance.gauss(0, 0.1), 4)
        ranges += [(place(k, at), ranged(10 * k, peer, near)) for at, peer in enumerate((A, B))]
    ordered = tuple(sorted(ranges, key=lambda placed: (placed[1].peer, placed[0])))
    chapter = Chapter(0, (), (), tuple(frames), ordered)
    assert len(packed(chapter)) < 60 * (70 + 2 * 54) / 15


def test_a_model_with_a_number_of_traits_that_none_has_is_refused() -> None:
    data = bytearray(packed(Chapter(0, (), ((5, UNTOLD),))))
    at = data.index((5).to_bytes(4, "big") + b"\x08") + 4
    for count in (-1 & 0xFF, 7, 15):
        data[at] = count
        with pytest.raises(ValueError, match="traits"):
            unpacked(bytes(data), SEQ)
