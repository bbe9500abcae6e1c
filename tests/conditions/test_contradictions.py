"""What is said where measurements contradict each other: whose fault it is, and what to do."""

from __future__ import annotations

import pytest

from drslamd.conditions import contradictions
from drslamd.slam.doubt import Doubt, Reason
from drslamd.slam.odometry.mounting import CURVES, SIDES, Fault, Repair
from drslamd.slam.relative_pose.estimate import Verdict
from drslamd.slam.relative_pose.mistakes.mounting_search import MOST, MountingSearch
from drslamd.slam.relative_pose.mistakes.what_if import MIRROR, Case


def found(case: Case | None, is_clear: bool = True) -> MountingSearch:
    search = MountingSearch()
    search.found, search.is_clear = case, is_clear
    return search


def said(
    case: Case | None, is_clear: bool = True, peer_is_odd: bool = False, has_learned: bool = True
) -> str | None:
    """Of robots 3 and 8, seen from robot 3."""
    return contradictions.mounting(3, 8, found(case, is_clear), peer_is_odd, has_learned)


NARROW, SHORT = Repair(Fault.TRACK, turn=0.67), Repair(Fault.SCALE, 1.5, 1.5)


def test_of_a_pair_that_agrees_nothing_is_said() -> None:
    assert said(None) is None


def test_of_what_is_not_clear_nothing_is_said() -> None:
    for case in (MIRROR, Case(a=SIDES[0]), Case(b=NARROW)):
        assert said(case, is_clear=False) is None


@pytest.mark.parametrize(
    ("case", "robot"), [(Case(a=SIDES[0]), 3), (Case(b=SIDES[0]), 8)], ids=["own", "peer"]
)
def test_a_side_that_runs_backwards_is_named_with_its_robot_and_its_key(
    case: Case, robot: int
) -> None:
    assert said(case) == (
        f"the wheels of robot {robot} run backwards on the left (set wheels.reverse_left)"
    )


def test_each_side_has_its_own_key() -> None:
    assert said(Case(b=SIDES[1])) == (
        "the wheels of robot 8 run backwards on the right (set wheels.reverse_right)"
    )


@pytest.mark.parametrize(("peer_is_odd", "whose"), [(False, "robot 3 or 8"), (True, "robot 8")])
def test_of_mirror_images_the_robot_is_named_only_where_another_is_a_witness(
    peer_is_odd: bool, whose: str
) -> None:
    sentence = said(MIRROR, peer_is_odd=peer_is_odd)
    assert sentence is not None
    assert sentence.startswith(f"the wheels of {whose} run backwards on both sides")
    for key in ("wheels.reverse_left", "wheels.reverse_right", "wheels.swap_channels"):
        assert key in sentence


def test_a_wheel_that_is_larger_than_the_other_is_told_by_where_the_odometry_turns() -> None:
    """The repair turns right: odometry had turned left, as if the right wheel ran further."""
    assert said(Case(b=CURVES[0])) == (
        "the odometry of robot 8 turns left by about 36 degrees a metre that it does not drive: "
        "its right wheel is smaller than the left one, or counts too much; look at both"
    )
    assert "turns right by about 4 degrees" in str(said(Case(a=CURVES[5])))


def test_a_track_is_told_as_what_to_make_of_the_configured_one() -> None:
    """Turns are 0.67 times as long as they seem: the track is 1.5 times as wide as configured."""
    assert said(Case(b=NARROW)) == (
        "wheels.track_m of robot 8 should be about 1.5 times what it is; it is learned meanwhile"
    )


def test_a_scale_is_told_as_what_to_make_of_the_odometry() -> None:
    sentence = said(Case(a=SHORT))
    assert sentence is not None
    assert sentence.startswith("the odometry of robot 3 should be about 1.5 times as long;")
    assert "wheels.counts_per_metre" in sentence


def test_a_track_or_a_scale_is_told_once_module_3_finds_the_same_and_sides_at_once() -> None:
    for case in (Case(b=NARROW), Case(a=SHORT)):
        assert said(case, has_learned=False) is None
    for case in (MIRROR, Case(b=SIDES[0])):
        assert said(case, has_learned=False) == said(case)


def test_robots_that_are_wrong_in_the_same_way_are_both_named() -> None:
    sentence = said(Case(SHORT, SHORT))
    assert sentence is not None
    assert sentence.index("of robot 3") < sentence.index("of robot 8")
    assert sentence.count("1.5 times as long") == 2


@pytest.mark.parametrize("is_puzzled", [True, False])
def test_what_no_mistake_explains_is_said_of_both(
    is_puzzled: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(MountingSearch, "is_puzzled", is_puzzled)
    search = MountingSearch()
    for _ in range(MOST):
        search.on_verdict(Verdict.POOR_FIT)
    sentence = contradictions.mounting(3, 8, search, False, False)
    if not is_puzzled:
        assert sentence is None
        return
    assert sentence is not None
    assert sentence.startswith("ranges and odometry of robots 3 and 8 contradict each other")
    assert "look at" in sentence


def test_a_pose_that_nobody_doubts_has_no_sentence() -> None:
    assert contradictions.doubt(None) is None


@pytest.mark.parametrize(("level", "times"), [(10.0, "some times"), (10.1, "over ten times")])
def test_odometry_is_told_by_few_words_that_stay_the_same(level: float, times: str) -> None:
    sentence = contradictions.doubt(Doubt(0, Reason.ODOMETRY, level=level))
    assert sentence is not None
    assert sentence.startswith(f"the pose is doubtful: odometry is {times} as wrong as configured;")
    assert "slip" in sentence


def test_odometry_that_is_worse_is_told_with_what_it_costs_and_what_to_do() -> None:
    assert contradictions.odometry(is_worse=False) is None
    sentence = contradictions.odometry(is_worse=True)
    assert sentence is not None
    assert "poses are less sure" in sentence
    assert "wheels slip" in sentence
    assert "doubt" not in sentence


def test_of_one_witness_both_robots_may_be_at_fault_and_of_two_only_the_own() -> None:
    one = contradictions.doubt(Doubt(0, Reason.RANGES, (4,)))
    two = contradictions.doubt(Doubt(0, Reason.RANGES, (4, 7)))
    assert one is not None
    assert two is not None
    assert "ranges to robot 4 and the odometry of both do not fit" in one
    assert "ranges to robots 4 and 7 do not fit the odometry of this robot" in two
    for sentence in (one, two):
        assert sentence.startswith("the pose is doubtful:")
        assert "slip" in sentence
        assert "sight is blocked" in sentence


@pytest.mark.parametrize(
    ("level", "long"),
    [
        (1.5, "about 1.5 times"),
        (1.74, "about 1.5 times"),
        (1.76, "about 2.0 times"),
        (7.1, "about 7.0 times"),
        (0.5, "at most half"),
        (0.14, "at most half"),
        (-0.2, "at most half"),
    ],
)
def test_odometry_of_odd_length_is_told_in_halves(level: float, long: str) -> None:
    sentence = contradictions.doubt(Doubt(0, Reason.SCALE, level=level))
    assert sentence is not None
    start = "the pose is doubtful: it fits only if odometry is "
    assert sentence.startswith(f"{start}{long} as long and turns as configured,")
    assert "look at the wheels of both sides" in sentence


@pytest.mark.parametrize(("peers", "named"), [((4,), "robot 4"), ((4, 7), "robot 4 and 7")])
def test_windows_that_fit_no_motion_are_told_with_their_robots(
    peers: tuple[int, ...], named: str
) -> None:
    sentence = contradictions.doubt(Doubt(0, Reason.WINDOWS, peers))
    assert sentence is not None
    start = f"the pose is doubtful: most ranges with {named} fit no motion that wheels"
    assert sentence.startswith(start)
    assert "look at the wheels" in sentence
    assert "is sight blocked?" in sentence


def test_windows_that_another_track_would_fit_are_told_with_what_helps() -> None:
    sentence = contradictions.doubt(Doubt(0, Reason.MOUNTINGS, (4,)))
    assert sentence == (
        "the pose is doubtful: ranges with robot 4 would fit better if a track width or counts per "
        "metre were others than configured; drive on, and it is learned, or measure them with "
        "drslamd calibrate"
    )


def test_a_pose_that_was_moved_is_told_as_what_lies_behind() -> None:
    assert contradictions.doubt(Doubt(0, Reason.REVISIONS)) == (
        "the pose is doubtful: later measurements moved it further than was claimed; wheels "
        "slipped or stood, or sight was blocked, within the last half minute"
    )


def test_robots_that_are_often_out_of_sight_are_named_in_order() -> None:
    assert contradictions.sight([]) is None
    assert contradictions.sight(frozenset({9, 2})) == (
        "many ranges to robot 2 and 9 are too long: sight between is blocked now and then; such "
        "ranges count for little; mount antennas higher, or drive where the robots see each other"
    )


def test_partners_in_doubt_are_named_in_order() -> None:
    assert contradictions.partners([]) is None
    assert contradictions.partners({7}) == (
        "ranges to robot 7 do not fit where it should be; sight between is blocked, or its wheels "
        "slip"
    )
    several = contradictions.partners(frozenset({9, 2, 4}))
    assert several is not None
    assert several.startswith("ranges to robot 2 and 4 and 9 do not fit")
