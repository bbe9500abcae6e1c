"""What was to be reached, on each side of its limit."""

from __future__ import annotations

import pytest
from lab.reproduce import verdict
from lab.reproduce.tally import Tally
from lab.reproduce.verdict import Check
from reproduce_totals import good


@pytest.mark.parametrize(
    ("check", "ok"),
    [
        (verdict.at_most("x", 1.0, 1.0), True),
        (verdict.at_most("x", 1.01, 1.0), False),
        (verdict.at_least("x", 1.0, 1.0), True),
        (verdict.at_least("x", 0.99, 1.0), False),
        (verdict.within("x", 0.8, 0.8, 1.25), True),
        (verdict.within("x", 1.26, 0.8, 1.25), False),
        (verdict.at_most("x", float("nan"), 1.0), False),
    ],
)
def test_a_check_on_each_side_of_its_limit(check: Check, ok: bool) -> None:
    assert check.ok is ok


def missed(total: Tally) -> list[str]:
    return [check.name for check in verdict.checks(total) if not check.ok]


def test_everything_reached_is_said_so() -> None:
    assert missed(good()) == []


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("odometry/m", 3.0, "odometry alone, m"),
        ("table1/50/both/m", 9.0, "coarse + NLS against nls alone"),
        ("table2/50/0.1/before/m", 50.0, "PCM lowers the error"),
        ("table2/10/0.2/after/deg", 50.0, "DPGO lowers it again, at all pose times"),
        ("table2/10/0.2/there/deg", 50.0, "DPGO lowers it again, where closures were kept"),
        ("table2/50/0.5/after/m", 2.0, "DPGO at tau 50, epsilon 0.5"),
        ("drslamd/after/m", 1.0, "half of the paper's row"),
        ("drslamd/after/deg", 9.0, "drslamd, final, deg"),
        ("table2/50/0.5/ate", 3.0, "joint ATE against the minimum's"),
        ("table2/10/0.2/rounds", 200.0, "rounds to within 1 %"),
        ("table4/paper/1/bytes", 9e6, "three daemons at 1 Hz"),
        ("drslamd/localised", 0.0, "localised"),
        ("drslamd/claim/wild", 1.0, "Mahalanobis > 50"),
        ("table1/10/drslamd/claim/below", 0.0, "closures at tau 10"),
        ("drslamd/published/nees", 3.0, "published poses: NEES"),
        ("drslamd/published/inside", 0.0, "95 % ellipse"),
    ],
)
def test_every_promise_can_be_missed(name: str, value: float, words: str) -> None:
    total = good()
    total.add(name, value)
    assert any(words in name for name in missed(total))


def test_no_answer_at_all_from_short_windows_is_honest_once_it_was_asked_for() -> None:
    total = good()
    for name in ("below", "wild"):
        del total.sums[f"table1/10/drslamd/claim/{name}"]
    assert any("tau 10 not marked" in name for name in missed(total))
    total.add("table1/10/drslamd/unique", 0.0)
    assert missed(total) == []
