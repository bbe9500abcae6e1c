"""LCM's event log: our bytes are those of the lcm package, and damage costs what it hit."""

from __future__ import annotations

import io
from pathlib import Path

import lcm
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drslamd.recording import event_log
from drslamd.recording.event_log import MAX_DATA, Damage, Entry, entries, packed

SETTINGS = settings(derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow])
CHANNELS = st.text(st.characters(min_codepoint=33, max_codepoint=126), min_size=1, max_size=63)
ENTRIES = st.builds(
    Entry, st.integers(0, 2**62), st.integers(0, 2**62), CHANNELS, st.binary(max_size=60)
)


def bytes_of(log: list[Entry]) -> bytes:
    return b"".join(packed(e.number, e.utime, e.channel.encode(), e.data) for e in log)


def read(data: bytes) -> list[Entry | Damage]:
    return list(entries(io.BytesIO(data)))


@SETTINGS
@given(st.lists(ENTRIES, max_size=5))
def test_what_was_written_is_read(log: list[Entry]) -> None:
    assert read(bytes_of(log)) == log


def test_the_lcm_package_writes_the_same_bytes_and_reads_ours(tmp_path: Path) -> None:
    log = [Entry(0, 7, "DRSLAM_POSE_003", b"abc"), Entry(1, 2**40, "REC_UWB_003", b"\0" * 500)]
    theirs = lcm.EventLog(str(tmp_path / "theirs"), "w", overwrite=True)
    for entry in log:
        theirs.write_event(entry.utime, entry.channel, entry.data)
    theirs.close()
    assert (tmp_path / "theirs").read_bytes() == bytes_of(log)
    (tmp_path / "ours").write_bytes(bytes_of(log))
    found = lcm.EventLog(str(tmp_path / "ours"), "r")
    assert [Entry(e.eventnum, e.timestamp, e.channel, e.data) for e in found] == log
    found.close()


TWO = [Entry(0, 1, "A", b"first"), Entry(1, 2, "B", b"second")]
ALL = bytes_of(TWO)
FIRST = len(bytes_of(TWO[:1]))


@pytest.mark.parametrize("size", range(FIRST + 1, len(ALL)))
def test_a_tail_that_was_cut_anywhere_is_said_and_all_before_it_is_read(size: int) -> None:
    assert read(ALL[:size]) == [TWO[0], Damage(FIRST, size - FIRST, True)]


@SETTINGS
@given(st.binary(max_size=80).filter(lambda b: b"\xed" not in b))
def test_bytes_between_two_entries_are_passed_over_and_said(between: bytes) -> None:
    found = read(bytes_of(TWO[:1]) + between + bytes_of(TWO[1:]))
    damage = [Damage(FIRST, len(between), False)] if between else []
    assert found == [TWO[0], *damage, TWO[1]]


@pytest.mark.parametrize(
    "head",
    [
        packed(0, 1, b"", b"x" * 40),
        packed(0, 1, b"C" * 256, b""),
        packed(0, 1, b"\xff", b"x" * 40),
        packed(0, 1, b"C", b"")[:24] + (MAX_DATA + 1).to_bytes(4, "big") + b"C",
    ],
)
def test_an_entry_that_no_robot_writes_is_damage(head: bytes) -> None:
    assert read(head + ALL) == [Damage(0, len(head), False), *TWO]


def test_a_file_that_is_larger_than_one_read_is_read_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(event_log, "CHUNK", 7)
    assert read(ALL) == TWO
    assert read(ALL[:-1]) == [TWO[0], Damage(FIRST, len(ALL) - FIRST - 1, True)]
    assert read(b"noise" + ALL) == [Damage(0, 5, False), *TWO]


def test_an_entry_of_the_longest_data_is_taken() -> None:
    log = [Entry(0, 1, "A", bytes(MAX_DATA))]
    assert read(bytes_of(log)) == log
