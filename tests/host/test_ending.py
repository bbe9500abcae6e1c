"""The ends of a program that no verb says: each in a process of its own, which it ends."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from drslamd.host.ending import ended_by_a_signal, stops

PROGRAM = """\
import signal, sys
from drslamd.host.ending import in_order
def act():
    {act}
    return 5
sys.exit(in_order(act, unwritable=73, bug=70))
"""
FULL = Path("/dev/full")


def ended(act: str, *, unbuffered: bool = False, **streams: object) -> tuple[int, str]:
    """Its exit code (below zero: the signal that ended it), and its standard error."""
    flags = ["-u"] if unbuffered else []
    program = [sys.executable, *flags, "-c", PROGRAM.format(act=act)]
    done = subprocess.run(program, stderr=subprocess.PIPE, text=True, check=False, **streams)  # type: ignore[call-overload]
    return done.returncode, done.stderr


def unread(act: str, unbuffered: bool) -> tuple[int, str]:
    """The same into a pipe that nobody reads."""
    with subprocess.Popen(["true"], stdin=subprocess.PIPE) as reader:
        reader.wait()
        return ended(act, unbuffered=unbuffered, stdout=reader.stdin)


def test_a_verb_that_ends_well_keeps_its_code() -> None:
    assert ended("print('x')", stdout=subprocess.DEVNULL) == (5, "")


@pytest.mark.parametrize("unbuffered", [False, True])
def test_where_nobody_reads_on_it_ends_as_others_do_and_without_a_word(unbuffered: bool) -> None:
    assert unread("print('x')", unbuffered) == (-signal.SIGPIPE, "")


def test_the_help_that_nobody_reads_says_nothing_either() -> None:
    assert unread("print('x'); sys.exit(0)", False) == (-signal.SIGPIPE, "")


def test_ctrl_c_ends_it_as_a_shell_expects_and_without_a_traceback() -> None:
    act = "signal.raise_signal(signal.SIGINT)"
    assert ended(act, stdout=subprocess.DEVNULL) == (-signal.SIGINT, "")


@pytest.mark.parametrize("unbuffered", [False, True])
def test_an_output_that_takes_no_more_is_one_sentence(unbuffered: bool) -> None:
    with FULL.open("w") as full:
        code, said = ended("print('x')", unbuffered=unbuffered, stdout=full)
    assert code == 73
    assert said.splitlines() == [
        "what there is to say cannot be written: [Errno 28] No space left on device; make room"
    ]


def test_a_bug_is_told_from_what_a_verb_finds() -> None:
    code, said = ended("1 / 0", stdout=subprocess.DEVNULL)
    assert code == 70
    assert "ZeroDivisionError" in said
    assert said.endswith("this is a bug; please report the lines above\n")


def test_a_file_that_a_verb_could_not_write_is_no_matter_of_the_output() -> None:
    act = "raise OSError(28, 'No space left on device', '/some/file')"
    assert ended(act, stdout=subprocess.DEVNULL)[0] == 70


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_stop_and_a_closed_terminal_end_what_goes_on_as_ctrl_c_does(
    number: signal.Signals,
) -> None:
    before = signal.getsignal(number)
    with pytest.raises(KeyboardInterrupt), ended_by_a_signal():
        signal.raise_signal(number)
    assert signal.getsignal(number) is before


def test_what_was_started_by_nohup_outlives_its_terminal() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        assert signal.SIGHUP not in stops()
    finally:
        signal.signal(signal.SIGHUP, before)
    assert signal.SIGHUP in stops()
