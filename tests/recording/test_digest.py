"""Equal for equal results and effects, and different for the last bit of any of them."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drslamd.conventions import Chain, Segment
from drslamd.events import Effect, Level, Note, Restart, Save, Send, Solve, Write
from drslamd.recording import digest
from drslamd.slam.graph.estimate import Learned, TeamEstimate, Trajectory
from drslamd.slam.relative_pose.estimate import Hypothesis, RelativePoseEstimate, Verdict

EFFECTS: list[Effect] = [
    Send("A", b"x"),
    Send("B", b"x"),
    Send("A", b"y"),
    Write("wheels", b"?C\r"),
    Solve(1, "optimizer", lambda: 0),
    Solve(2, "optimizer", lambda: 0),
    Solve(1, "consistency", lambda: 0),
    Save({"epoch": 1}),
    Save({"epoch": 2}),
    Restart(1, "why"),
    Note(Level.INFO, "pose.well", {"after_s": 1}),
    Note(Level.WARNING, "pose.well", {"after_s": 1}),
    Note(Level.INFO, "pose.well", {"after_s": 2}),
]


def test_no_two_effects_have_the_same_digest() -> None:
    assert len({digest.of_effect(effect) for effect in EFFECTS}) == len(EFFECTS)


def test_the_order_of_effects_counts() -> None:
    one, two = EFFECTS[:2]
    forth = digest.of_effect(two, digest.of_effect(one))
    assert forth != digest.of_effect(one, digest.of_effect(two))


def test_a_computation_counts_by_its_name_and_not_by_what_it_is_made_of() -> None:
    one, other = Solve(1, "optimizer", lambda: 0), Solve(1, "optimizer", lambda: 1)
    assert digest.of_effect(one) == digest.of_effect(other)


POSE = np.array([1.0, 2.0, 0.5])
WINDOW = RelativePoseEstimate(Verdict.UNIQUE, (Hypothesis(POSE, np.eye(3), 4.0),))
TEAM = TeamEstimate(
    Segment(0, 1, 0),
    {0: Trajectory(Chain(0, 1), np.arange(3), np.ones((3, 3)))},
    bias_m={(0, 1): Learned(0.1, 0.2)},
    contradicted=frozenset({(0, 2), (0, 1)}),
)
ONE_BIT = math.nextafter(0.1, 1.0)


@pytest.mark.parametrize(
    ("result", "other"),
    [
        (WINDOW, replace(WINDOW, verdict=Verdict.AMBIGUOUS)),
        (WINDOW, replace(WINDOW, hypotheses=())),
        (WINDOW, replace(WINDOW, hypotheses=(Hypothesis(POSE, np.eye(3), np.nextafter(4.0, 5)),))),
        (TEAM, replace(TEAM, bias_m={(0, 1): Learned(ONE_BIT, 0.2)})),
        (TEAM, replace(TEAM, contradicted=frozenset({(0, 2)}))),
        (TEAM, replace(TEAM, trajectories={})),
        (TEAM, replace(TEAM, joint=np.zeros((3, 3)))),
        ((np.zeros(3), 1.0), (np.zeros(3), 2.0)),
        ([[1], []], [[], [1]]),
        (np.zeros((2, 3)), np.zeros((3, 2))),
    ],
)
def test_the_last_bit_of_a_result_counts(result: Any, other: Any) -> None:
    assert digest.of_result(result) != digest.of_result(other)


def test_equal_results_have_equal_digests() -> None:
    same = replace(TEAM, contradicted=frozenset({(0, 1), (0, 2)}))
    assert digest.of_result(same) == digest.of_result(TEAM)
    assert digest.of_result(POSE[::1]) == digest.of_result(POSE.copy())


def test_a_result_that_was_never_thought_of_is_our_mistake() -> None:
    with pytest.raises(TypeError, match="a computation found a bytearray"):
        digest.of_result(bytearray())


def test_what_a_solver_keeps_for_the_next_solution_is_no_part_of_this_one() -> None:
    found = TeamEstimate(Segment(1, 2, 0), {})
    kept = replace(found, kept=(slice(0, 3), object()))
    assert digest.of_result(kept) == digest.of_result(found)
