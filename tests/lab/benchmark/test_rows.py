"""Rows of the benchmark: goals, ratios, JSON, and what counts as worse."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from lab.benchmark import rows
from lab.benchmark.rows import Peer, Row


def row(value: float, peer: float = 10.0, unit: str = "ms", work: str = "some") -> Row:
    return Row(1, work, value, unit, 5.0, None, (Peer("other", peer, True), Peer("far", 9, False)))


def test_a_row_meets_its_goal_or_not() -> None:
    assert row(5.0).is_met
    assert not row(5.1).is_met
    assert row(5.0, unit="share").is_met
    assert not row(4.9, unit="share").is_met
    assert Row(1, "some", 3.0, "ms").is_met is None


@pytest.mark.parametrize(("times", "met"), [(4.9, True), (5.1, False)])
def test_a_goal_may_be_how_many_times_as_fast_as_a_peer_of_the_same_run(
    times: float, met: bool
) -> None:
    wanted = replace(row(2.0), goal=None, times=times)
    assert wanted.is_met is met
    assert f"| {times} x {'✓' if met else 'MISSED'} |" in rows.markdown([wanted])
    assert not replace(wanted, peers=wanted.peers[1:]).is_met


def test_only_peers_of_the_same_run_give_a_ratio() -> None:
    assert row(2.0).ratios() == {"other": 5.0}


def test_the_table_says_value_goal_ratio_and_what_is_only_quoted() -> None:
    text = rows.markdown([row(2.0), row(6.0)]).splitlines()
    assert text[2] == "| 1 | some | 2 ms |  | 5 ✓ | other 10 (5.0 x) | far 9 |"
    assert "5 MISSED" in text[3]


def test_json_gives_the_rows_back() -> None:
    some = [row(2.0), Row(0, "x", 1.0, "rounds")]
    assert rows.from_json(json.loads(json.dumps(rows.to_json(some)))) == some


@pytest.mark.parametrize(
    ("now", "then", "worse"),
    [
        (row(2.9), row(2.0), False),
        (row(3.1), row(2.0), True),
        # the machine became slower, and the peer with it
        (row(8.0, peer=40.0), row(2.0), False),
        (row(1.09, unit="rounds"), row(1.0, unit="rounds"), False),
        (row(1.2, unit="rounds"), row(1.0, unit="rounds"), True),
        (row(0.95, unit="share"), row(1.0, unit="share"), False),
        (row(0.90, unit="share"), row(1.0, unit="share"), True),
        (row(9.0, unit="share"), row(1.0, unit="share"), False),
        (row(1e-9, unit="gap"), row(1e-12, unit="gap"), False),
        (row(9.0, work="new"), row(1.0), False),
    ],
)
def test_a_regression_is_a_ratio_or_a_count_that_became_worse(
    now: Row, then: Row, worse: bool
) -> None:
    assert bool(rows.regressions([now], [then])) == worse
