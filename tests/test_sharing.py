"""The parts of the suite that interpreters share: together they are all, and each has some."""

from __future__ import annotations

import pytest

FILE = """
import pytest

@pytest.mark.parametrize("number", range(7))
def test_quick(number):
    pass

@pytest.mark.slow
@pytest.mark.parametrize("number", range(3))
def test_slow(number):
    pass
"""
LINES = ("-p", "sharing", "-o", "markers=slow", "-m", "not slow", "-v")


def numbers(pytester: pytest.Pytester, *share: str) -> list[int]:
    """Of the tests that ran."""
    pytester.makepyfile(FILE)
    said = pytester.runpytest_inprocess(*LINES, *share)
    ran = [line for line in said.outlines if "PASSED" in line]
    said.assert_outcomes(passed=len(ran), deselected=10 - len(ran))
    return [int(line.split("[")[1][0]) for line in ran]


def test_every_test_is_in_one_part_and_each_part_has_every_third(pytester: pytest.Pytester) -> None:
    parts = [numbers(pytester, "--share", f"{part}/3") for part in (1, 2, 3)]
    assert parts == [[0, 3, 6], [1, 4], [2, 5]]


@pytest.mark.parametrize("share", [(), ("--share", "1/1")])
def test_who_shares_with_nobody_runs_all(pytester: pytest.Pytester, share: tuple[str, ...]) -> None:
    assert numbers(pytester, *share) == list(range(7))


@pytest.mark.parametrize("share", ["0/3", "4/3", "1", "a/b"])
def test_what_is_no_part_is_refused(pytester: pytest.Pytester, share: str) -> None:
    pytester.makepyfile(FILE)
    said = pytester.runpytest_inprocess(*LINES, "--share", share)
    assert said.ret == pytest.ExitCode.USAGE_ERROR
