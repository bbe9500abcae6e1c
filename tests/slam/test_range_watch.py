"""Ranges of this very second against where two robots must be, worked out on matrices."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from slam_scenes import EXACT, Array, inverted, product

from drslamd.conventions import GRID_US, Chain, Segment
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.estimate import MUCH_WORSE, Learned, TeamEstimate, Trajectory
from drslamd.slam.graph.measurements import Keyframe
from drslamd.slam.odometry import jumps
from drslamd.slam.odometry.jumps import Jump
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.odometry.track import Track
from drslamd.slam.range_model import LINKTRACK
from drslamd.slam.range_watch import (
    AT_LENGTH,
    FAR_SIGMAS,
    IN_A_ROW,
    LASTS,
    LATE_US,
    MOST_BIAS_M,
    UNLIKELY,
    Partner,
    RangeWatch,
)
from drslamd.slam.relative_pose.pair_end import PairEnd
from drslamd.slam.relative_pose.range_buffer import RangeBuffer
from drslamd.slam.robot_model import RobotModel

AHEAD = 1_000
"""Samples by which the clock of the partner is ahead."""
SOLVED, NEWEST = 100, 130
"""Samples of our clock at which both were solved, and of the last keyframe of the partner."""
SIGMA = 0.1
OWN, PARTNER = 3, 5
W_OWN, W_PARTNER = np.array([1.0, 2.0, 0.5]), np.array([6.0, -1.0, 2.0])
"""Solved poses."""
BOTH = np.concatenate([W_OWN, W_PARTNER])
KNOWN = np.array([[0.04, 0.01, 0.004], [0.01, 0.09, -0.006], [0.004, -0.006, 0.0025]])
MODELS = RobotModel(EXACT, 0.3, 0.1, 0.2), RobotModel(EXACT, -0.2, 0.25, 1.4)
SURE = Learned(0.0, 0.0)


class Scene:
    """Both drive ahead at 0.5 m/s since they were solved; the partner says so every second."""

    def __init__(
        self,
        models: tuple[RobotModel, RobotModel] = MODELS,
        end: int = NEWEST + 2,
    ) -> None:
        self.track, self.ranges = Track(1_000), RangeBuffer(10.0)
        self.own, self.partner = ChainData(Chain(OWN, 1)), ChainData(Chain(PARTNER, 1))
        for data, model in ((self.own, models[0]), (self.partner, models[1])):
            data.take_model(0, model)
        for n in range(SOLVED - 20, end):
            steps = self.steps(n)
            self.track.append(n, np.array(steps, dtype=float))
            if n % 10 == 0 and n <= NEWEST:
                self.partner.add(Keyframe(n + AHEAD, 0, *steps))
        self.watch = RangeWatch(SIGMA, LINKTRACK)
        self.utime = (end - 1) * GRID_US

    @staticmethod
    def steps(n: int) -> tuple[int, int, int]:
        """5 cm a sample."""
        return 500 * (n - SOLVED), 0, 0

    def hear(self, metres: float, first: int, last: int, gap_db: float = 0.0) -> None:
        for n in range(first, last + 1):
            self.ranges.add(n * GRID_US, metres, gap_db)

    def look(self, estimate: TeamEstimate | None, utime: int | None = None) -> dict[int, int]:
        partners = {PARTNER: Partner(self.partner, AHEAD * GRID_US, self.ranges)}
        end = PairEnd(self.track, self.own)
        self.watch.look(estimate, end, partners, self.utime if utime is None else utime)
        return self.watch.off


def solved(joint: Array | None = None, bias: Learned = SURE) -> TeamEstimate:
    """Both at sample 100, of which a covariance is known."""
    trajectories = {
        PARTNER: Trajectory(Chain(PARTNER, 1), np.array([SOLVED + AHEAD]), W_PARTNER[None]),
        OWN: Trajectory(Chain(OWN, 1), np.array([SOLVED]), W_OWN[None]),
    }
    covariance = np.zeros((6, 6)) if joint is None else joint
    return TeamEstimate(
        Segment(OWN, 1, 0), trajectories, joint=covariance, bias_m={(OWN, PARTNER): bias}
    )


def between(
    poses: Array = BOTH,
    ways: tuple[tuple[float, float], tuple[float, float]] = ((1.5, 0.0), (1.5, 0.0)),
    beside: tuple[tuple[float, float], tuple[float, float]] = ((0.0, 0.0), (0.0, 0.0)),
) -> float:
    """Metres between the antennas after ways of so many metres along a heading, seen from above."""
    tips = []
    for pose, (way, turned), model, (x, y) in zip(
        (poses[:3], poses[3:]), ways, MODELS, beside, strict=True
    ):
        arm = (model.antenna_x_m + x, model.antenna_y_m + y, 0.0)
        tips.append(product(pose, (0.0, 0.0, turned), (way, 0.0, 0.0), arm)[:2])
    return math.hypot(*(tips[1] - tips[0]))


def measured(from_above: float, sigmas: float, sigma: float, near_bias: float = 0.0) -> float:
    """What a module says that is so many sigmas too long, with antennas 1.2 m apart in height."""
    seen = from_above
    for _ in range(50):
        width = math.hypot(sigma, float(LINKTRACK.near_range_sigma(seen)))
        seen = from_above + near_bias * math.exp(-from_above / 3.0) + sigmas * width
    return math.hypot(seen, MODELS[1].antenna_z_m - MODELS[0].antenna_z_m)


def is_off(scene: Scene, estimate: TeamEstimate, metres: float) -> bool:
    scene.hear(metres, NEWEST - 8, NEWEST + 1)
    found = scene.look(estimate)
    assert set(found) == {PARTNER}
    return found[PARTNER] == 1


BOTH_SIDES = [
    (FAR_SIGMAS - 0.05, False),
    (FAR_SIGMAS + 0.05, True),
    (0.05 - FAR_SIGMAS, False),
    (-0.05 - FAR_SIGMAS, True),
]


@pytest.mark.parametrize(("sigmas", "wrong"), BOTH_SIDES)
def test_a_range_is_off_beyond_three_sigmas_of_its_noise(sigmas: float, wrong: bool) -> None:
    assert is_off(Scene(), solved(), measured(between(), sigmas, SIGMA)) is wrong


@pytest.mark.parametrize(("sigmas", "wrong"), BOTH_SIDES)
def test_what_is_not_known_of_both_poses_counts_as_it_moves_the_range(
    sigmas: float, wrong: bool
) -> None:
    """With the derivative by differences; own pose and partner's are correlated."""
    mixed = np.block([[KNOWN, 0.5 * KNOWN], [0.5 * KNOWN, 2 * KNOWN]])
    h = 1e-6
    j = np.array([(between(BOTH + h * u) - between(BOTH - h * u)) / (2 * h) for u in np.eye(6)])
    sigma = math.sqrt(float(j @ mixed @ j) + SIGMA**2)
    # the estimate names the partner first
    order = [3, 4, 5, 0, 1, 2]
    estimate = solved(mixed[np.ix_(order, order)])
    assert sigma > 2 * SIGMA
    assert is_off(Scene(), estimate, measured(between(), sigmas, sigma)) is wrong


@pytest.mark.parametrize(("sigmas", "wrong"), BOTH_SIDES)
@pytest.mark.parametrize(("level", "times"), [({}, 2.0), ({OWN: 3.0}, 10.0), ({7: 9.0}, 2.0)])
def test_the_ways_since_then_count_by_as_much_as_odometry_is_believed(
    level: dict[int, float], times: float, sigmas: float, wrong: bool
) -> None:
    """Wheels that only slide: 0.1 m in each direction after a metre, both for 1.5 m."""
    slides = OdometryNoise(1e-9, 1e-9, 0.1, 1e-9)
    one, other = (replace(model, noise=slides) for model in MODELS)
    estimate = replace(solved(), odometry_level=level)
    sigma = math.sqrt(0.1**2 * 1.5 * times + SIGMA**2)
    scene = Scene((one, other))
    assert is_off(scene, estimate, measured(between(), sigmas, sigma)) is wrong


@pytest.mark.parametrize(("sigmas", "wrong"), BOTH_SIDES)
@pytest.mark.parametrize("bias", [Learned(0.4, 0.2), Learned(-0.3, math.inf)])
def test_a_bias_is_taken_out_as_far_as_it_is_known_and_never_less_than_to_a_metre(
    bias: Learned, sigmas: float, wrong: bool
) -> None:
    sigma = math.hypot(min(bias.sigma, MOST_BIAS_M), SIGMA)
    metres = measured(between() + bias.value, sigmas, sigma)
    assert is_off(Scene(), solved(bias=bias), metres) is wrong


@pytest.mark.parametrize(("sigmas", "wrong"), BOTH_SIDES)
def test_what_strong_signals_do_is_taken_out_too(sigmas: float, wrong: bool) -> None:
    estimate = replace(solved(), near_bias_m=Learned(-1.5, 0.1))
    assert is_off(Scene(), estimate, measured(between(), sigmas, SIGMA, -1.5)) is wrong


@pytest.mark.parametrize(("sigmas", "wrong"), BOTH_SIDES)
def test_what_was_learned_of_wheels_and_antennas_is_taken_out(sigmas: float, wrong: bool) -> None:
    """Of us a scale and a turn, of the partner an antenna: ways of 1.2 m, and a turn of 0.6 rad
    that was one of 0.9."""
    estimate = replace(
        solved(),
        scale={OWN: Learned(0.2, 0.0)},
        turn={OWN: Learned(0.5, 0.0)},
        antenna_m={PARTNER: (Learned(0.3, 0.0), Learned(-0.4, 0.0))},
    )
    scene = Scene()
    # a robot that turned on the spot where it was solved, before it drove
    scene.track = Track(1_000)
    for n in range(SOLVED - 20, NEWEST + 2):
        x = max(n - SOLVED - 1, 0) * 500
        turned = [round(x * math.cos(0.6)), round(x * math.sin(0.6)), 6_000]
        scene.track.append(n, np.array(turned if n > SOLVED else [0] * 3, dtype=float))
    predicted = between(ways=((0.8 * 1.45, 0.9), (1.5, 0.0)), beside=((0.0, 0.0), (0.3, -0.4)))
    assert is_off(scene, estimate, measured(predicted, sigmas, SIGMA)) is wrong


def test_what_does_not_fit_for_two_seconds_is_doubt_and_what_fits_ends_it() -> None:
    scene, good = Scene(), measured(between(), 0.0, SIGMA)
    bad = good + 3.0
    counts, doubts = [], []
    for metres in (bad, bad, bad, good, bad):
        scene.ranges = RangeBuffer()
        scene.hear(metres, NEWEST - 8, NEWEST + 1)
        counts.append(scene.look(solved())[PARTNER])
        doubts.append(scene.watch.doubted == {PARTNER})
        assert scene.watch.looked_at == {PARTNER}
    assert counts == [1, 2, 3, 0, 1]
    assert doubts == [count >= IN_A_ROW for count in counts]


def test_who_could_not_be_looked_at_begins_again() -> None:
    scene = Scene()
    scene.hear(30.0, NEWEST - 8, NEWEST + 1)
    for expected in ({PARTNER: 1}, {PARTNER: 2}):
        assert scene.look(solved()) == expected
    assert scene.look(None) == {}
    assert (scene.watch.doubted, scene.watch.looked_at) == (frozenset(), frozenset())
    assert scene.look(solved()) == {PARTNER: 1}


def test_one_that_says_nothing_for_long_stands_where_it_was_and_we_drive_on() -> None:
    """Its last keyframe is compared with ranges of then while it is fresh, and with those of now
    when it is old."""
    late = LATE_US // GRID_US
    for end, stands in ((NEWEST + late, False), (NEWEST + late + 1, True)):
        scene = Scene(end=end + 1)
        assert scene.utime == end * GRID_US
        way = 0.05 * (end - SOLVED)
        scene.hear(measured(between(), 0.0, SIGMA), NEWEST - 8, NEWEST + 4)
        scene.hear(measured(between(ways=((way, 0.0), (1.5, 0.0))), 0.0, SIGMA), end - 8, end)
        assert scene.look(solved()) == {PARTNER: 0}
        # the other ranges are not looked at
        wrong = Scene(end=end + 1)
        wrong.hear(99.0 if stands else measured(between(), 0.0, SIGMA), NEWEST - 8, NEWEST + 4)
        then = between(ways=((way, 0.0), (1.5, 0.0)))
        wrong.hear(measured(then, 0.0, SIGMA) if stands else 99.0, end - 8, end)
        assert wrong.look(solved()) == {PARTNER: 0}


@pytest.mark.parametrize(("blocked", "wrong"), [(5, False), (6, True)])
def test_blocked_ranges_are_left_out_while_half_of_them_remain(blocked: int, wrong: bool) -> None:
    scene, good = Scene(), measured(between(), 0.0, SIGMA)
    # ten of them come within half a second of the keyframe
    first = NEWEST - 4
    scene.hear(good + 2.0, first, first + blocked - 1, gap_db=20.0)
    scene.hear(good, first + blocked, first + 9)
    scene.utime += 4 * GRID_US
    assert (scene.look(solved())[PARTNER] == 1) is wrong


@pytest.mark.parametrize(("sigmas", "wrong"), BOTH_SIDES)
def test_a_pose_of_later_is_carried_back_along_the_way(sigmas: float, wrong: bool) -> None:
    """We were solved half a second after the last word of the partner."""
    later = replace(solved(), trajectories={**solved().trajectories, OWN: solved_own(NEWEST + 5)})
    metres = measured(between(ways=((-0.25, 0.0), (1.5, 0.0))), sigmas, SIGMA)
    assert is_off(Scene(end=NEWEST + 10), later, metres) is wrong


def solved_own(n: int) -> Trajectory:
    return Trajectory(Chain(OWN, 1), np.array([n]), W_OWN[None])


def nobody(scene: Scene, estimate: TeamEstimate, utime: int | None = None) -> bool:
    """Can nothing be said, though ranges are 30 m too long?"""
    scene.hear(40.0, NEWEST - 8, NEWEST + 1)
    return scene.look(estimate, utime) == {}


def test_where_something_is_not_known_nothing_is_said() -> None:
    def without(robot: int) -> TeamEstimate:
        rest = {k: t for k, t in solved().trajectories.items() if k != robot}
        return replace(solved(), trajectories=rest)

    def other_start(robot: int) -> TeamEstimate:
        old = solved().trajectories[robot]
        new = replace(old, chain=Chain(robot, 2))
        return replace(solved(), trajectories={**solved().trajectories, robot: new})

    assert not nobody(Scene(), solved())
    for robot in (OWN, PARTNER):
        assert nobody(Scene(), without(robot))
        assert nobody(Scene(), other_start(robot))
    # of the partner nothing is claimed
    assert nobody(Scene(), solved(np.zeros((3, 3))))
    # its solved keyframe is not held
    gone = Trajectory(Chain(PARTNER, 1), np.array([SOLVED + AHEAD + 1]), W_PARTNER[None])
    assert nobody(Scene(), replace(solved(), trajectories={**solved().trajectories, PARTNER: gone}))


def test_across_a_break_of_either_odometry_nothing_is_said() -> None:
    scene = Scene()
    scene.partner = ChainData(Chain(PARTNER, 1))
    for n in range(SOLVED, NEWEST + 1, 10):
        scene.partner.add(Keyframe(n + AHEAD, int(n > 110), *scene.steps(n)))
    assert nobody(scene, solved())
    scene = Scene()
    scene.track = Track(1_000)
    for n in range(SOLVED - 20, NEWEST + 2):
        if n != 120:
            scene.track.append(n, np.array(scene.steps(n), dtype=float))
    assert nobody(scene, solved())


def test_without_ranges_keyframes_or_odometry_of_that_time_nothing_is_said() -> None:
    scene = Scene()
    assert scene.look(solved()) == {}
    scene.hear(40.0, NEWEST - 30, NEWEST - 5)
    assert scene.look(solved()) == {}
    empty = Scene()
    empty.partner = ChainData(Chain(PARTNER, 1))
    assert nobody(empty, solved())
    empty = Scene()
    empty.track = Track(10)
    assert nobody(empty, solved())
    # our odometry does not reach to its keyframe
    behind = Scene()
    behind.track = Scene(end=NEWEST).track
    assert nobody(behind, solved())
    behind.track = Scene(end=NEWEST + 1).track
    assert not nobody(behind, solved())


def test_antennas_that_touch_have_a_direction_of_any_kind() -> None:
    scene = Scene()
    apart = product(W_OWN, (1.5, 0.0, 0.0), (0.3, 0.1, 0.0))
    peer = product(apart, inverted((1.5 - 0.2, 0.25, 0.0)))
    there = Trajectory(Chain(PARTNER, 1), np.array([SOLVED + AHEAD]), peer[None])
    estimate = replace(solved(), trajectories={**solved().trajectories, PARTNER: there})
    assert is_off(scene, estimate, 1.25) is False


# by how much

TWIN = 7
"""Another partner, that drives where the first one does."""


def gap_m(scene: Scene | None = None, **metres_off: float) -> float:
    """Of one second in which ranges to the partner, to its twin, or to both are so far off."""
    scene = scene or Scene()
    twin = ChainData(Chain(TWIN, 1))
    twin.take_model(0, MODELS[1])
    for n in range(SOLVED, NEWEST + 1, 10):
        twin.add(Keyframe(n + AHEAD, 0, *scene.steps(n)))
    one = solved()
    there = Trajectory(Chain(TWIN, 1), np.array([SOLVED + AHEAD]), W_PARTNER[None])
    trajectories, biases = {**one.trajectories, TWIN: there}, {**one.bias_m, (OWN, TWIN): SURE}
    estimate = replace(one, trajectories=trajectories, bias_m=biases, joint=np.zeros((9, 9)))
    partners = {}
    for name, data in (("partner", scene.partner), ("twin", twin)):
        scene.ranges = RangeBuffer(10.0)
        if name in metres_off:
            metres = measured(between() + metres_off[name], 0.0, SIGMA)
            scene.hear(metres, NEWEST - 8, NEWEST + 1)
        partners[data.chain.robot] = Partner(data, AHEAD * GRID_US, scene.ranges)
    scene.watch.look(estimate, PairEnd(scene.track, scene.own), partners, scene.utime)
    assert len(scene.watch.looked_at) == len(metres_off)
    # one second is no doubt yet
    assert scene.watch.doubted == frozenset()
    return scene.watch.gap_m


@pytest.mark.parametrize(
    ("partner", "twin", "most"),
    [(2.0, 3.0, 3.0), (3.0, -2.0, 3.0), (-2.0, -3.0, 3.0), (2.0, 0.0, 2.0), (0.1, 0.1, 0.0)],
)
def test_a_pose_may_be_as_far_off_as_any_range_is(partner: float, twin: float, most: float) -> None:
    """Who goes past one partner is seen by the other only."""
    assert gap_m(partner=partner, twin=twin) == pytest.approx(most, abs=1e-3)


@pytest.mark.parametrize(("level", "is_theirs"), [(MUCH_WORSE - 0.01, False), (MUCH_WORSE, True)])
def test_a_partner_that_is_known_to_slip_makes_no_gap_of_ours(
    level: float, is_theirs: bool
) -> None:
    scene = Scene()
    scene.hear(measured(between() + 2.0, 0.0, SIGMA), NEWEST - 8, NEWEST + 1)
    assert scene.look(replace(solved(), late_level={PARTNER: level}))[PARTNER] == 1
    assert scene.watch.gap_m == pytest.approx(0.0 if is_theirs else 2.0, abs=1e-3)


def test_a_gap_that_was_doubt_is_feared_for_some_seconds() -> None:
    scene = Scene()
    scene.hear(measured(between() + 2.0, 0.0, SIGMA), NEWEST - 8, NEWEST + 1)
    for _ in range(IN_A_ROW):
        scene.look(solved())
    scene.ranges = RangeBuffer(10.0)
    scene.hear(measured(between(), 0.0, SIGMA), NEWEST - 8, NEWEST + 1)
    for _ in range(LASTS - 1):
        assert scene.look(solved())[PARTNER] == 0
        assert scene.watch.gap_m == pytest.approx(2.0, abs=1e-3)
    scene.look(solved())
    assert scene.watch.gap_m == 0.0


# second after second


def after(scene: Scene, sigmas: list[float | None], estimate: TeamEstimate | None = None) -> float:
    """How far off the pose may be after seconds whose ranges are so many sigmas too long, or not
    there."""
    for off in sigmas:
        scene.ranges = RangeBuffer(10.0)
        if off is not None:
            scene.hear(measured(between(), off, SIGMA), NEWEST - 8, NEWEST + 1)
        scene.look(estimate or solved())
    return scene.watch.gap_m


def metres(sigmas: float) -> float:
    """Of a range that is so many too long, in the plane."""
    high = MODELS[1].antenna_z_m - MODELS[0].antenna_z_m
    return math.sqrt(measured(between(), sigmas, SIGMA) ** 2 - high**2) - between()


EACH = math.sqrt(UNLIKELY / AT_LENGTH)
"""Sigmas that ranges must be off in every second."""


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_ranges_that_are_a_little_off_for_some_seconds_are_a_gap(sign: float) -> None:
    over, under = sign * (EACH + 0.01), sign * (EACH - 0.01)
    assert after(Scene(), [over] * AT_LENGTH) == pytest.approx(abs(metres(over)), abs=1e-3)
    assert after(Scene(), [under] * AT_LENGTH) == 0.0
    assert after(Scene(), [over] * (AT_LENGTH - 1)) == 0.0
    # and nobody doubts for that
    scene = Scene()
    after(scene, [over] * 10)
    assert scene.watch.doubted == frozenset()


def test_such_a_gap_is_the_root_mean_square_of_its_seconds_and_ends_with_them() -> None:
    off = [2.0, 0.5, -1.0]
    scene = Scene()
    expected = math.sqrt(sum(metres(sigmas) ** 2 for sigmas in off) / 3)
    assert after(scene, [0.0, 0.0, *off]) == pytest.approx(expected, abs=1e-3)
    # 0.25 and 1 and 0 are less than four
    assert after(scene, [0.0]) == 0.0


def test_seconds_without_ranges_part_those_that_are_looked_at_together() -> None:
    assert after(Scene(), [2.0, 2.0, None, 2.0, 2.0]) == 0.0
    assert after(Scene(), [None, 2.0, 2.0, 2.0]) == pytest.approx(metres(2.0), abs=1e-3)


@pytest.mark.parametrize(("twin", "is_gap"), [(EACH - 0.01, True), (EACH - 0.03, False)])
def test_ranges_to_all_partners_count_together(twin: float, is_gap: bool) -> None:
    """One is off by 0.02 sigmas more than it takes."""
    scene, off = Scene(), {"partner": metres(EACH + 0.02), "twin": metres(twin)}
    found = [gap_m(scene, **off) for _ in range(AT_LENGTH)]
    assert found[:-1] == [0.0] * (AT_LENGTH - 1)
    assert found[-1] == pytest.approx(metres(EACH + 0.02) if is_gap else 0.0, abs=1e-3)


@pytest.mark.parametrize(("level", "is_theirs"), [(MUCH_WORSE - 0.01, False), (MUCH_WORSE, True)])
def test_such_a_gap_is_not_ours_where_the_partner_is_known_to_slip(
    level: float, is_theirs: bool
) -> None:
    estimate = replace(solved(), late_level={PARTNER: level})
    expected = 0.0 if is_theirs else metres(2.0)
    assert after(Scene(), [2.0] * AT_LENGTH, estimate) == pytest.approx(expected, abs=1e-3)


# wheels that jumped


def jumped(
    scene: Scene, monkeypatch: pytest.MonkeyPatch, way: tuple[float, float] | None, n: int = 110
) -> float:
    """What is feared if our wheels went farther by such a way, along the axes of odometry."""
    jump = None if way is None else Jump(n, np.array(way), n)
    monkeypatch.setattr(jumps, "feared", lambda track: jump)
    scene.look(solved())
    return scene.watch.gap_m


def to_partner() -> Array:
    """Unit line of sight along our odometry, which begins where we were solved."""
    ways = [
        product(pose, (1.5, 0.0, 0.0), (model.antenna_x_m, model.antenna_y_m, 0.0))[:2]
        for pose, model in zip((W_OWN, W_PARTNER), MODELS, strict=True)
    ]
    sight = inverted(np.array([0.0, 0.0, W_OWN[2]]))
    u = product(sight, (*(ways[1] - ways[0]), 0.0))[:2]
    return np.asarray(u / np.hypot(*u))


@pytest.mark.parametrize("metres", [2.0, -2.0])
def test_a_jump_is_feared_until_a_range_says_where_we_are(
    metres: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = Scene()
    along, across = metres * to_partner(), metres * to_partner() @ [[0.0, 1.0], [-1.0, 0.0]]
    # nobody is heard
    assert jumped(scene, monkeypatch, tuple(along)) == pytest.approx(2.0)
    scene.hear(measured(between(), 0.0, SIGMA), NEWEST - 8, NEWEST + 1)
    # half a metre across the line of sight changes no range
    assert jumped(scene, monkeypatch, tuple(across / 4)) == pytest.approx(0.5)
    assert jumped(scene, monkeypatch, tuple(along)) == 0.0
    # it stays believed, but the next jump is another one
    assert jumped(scene, monkeypatch, tuple(across / 4)) == 0.0
    assert jumped(scene, monkeypatch, tuple(across / 4), n=115) == pytest.approx(0.5)
    assert jumped(scene, monkeypatch, None) == 0.0


def test_ranges_that_fit_neither_clear_nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = Scene()
    scene.hear(measured(between(), 2.0, SIGMA), NEWEST - 8, NEWEST + 1)
    assert jumped(scene, monkeypatch, tuple(2.0 * to_partner())) == pytest.approx(2.0)


def test_who_cannot_be_looked_at_has_no_say_in_how_far_a_pose_is_off() -> None:
    assert gap_m(partner=2.0) == pytest.approx(2.0, abs=1e-3)
    assert gap_m(twin=-1.5) == pytest.approx(1.5, abs=1e-3)
    assert gap_m() == 0.0


@pytest.mark.parametrize(("sigmas", "wrong"), BOTH_SIDES)
def test_what_is_noise_makes_no_gap(sigmas: float, wrong: bool) -> None:
    scene, metres = Scene(), measured(between(), sigmas, SIGMA)
    assert scene.watch.gap_m == 0.0
    assert is_off(scene, solved(), metres) is wrong
    level_m = math.sqrt(metres**2 - (MODELS[1].antenna_z_m - MODELS[0].antenna_z_m) ** 2)
    expected = abs(level_m - between()) if wrong else 0.0
    assert scene.watch.gap_m == pytest.approx(expected, abs=1e-3)
    # it is that of the last second only
    assert scene.look(None) == {}
    assert scene.watch.gap_m == 0.0


def drove(scene: Scene, estimate: TeamEstimate) -> TeamEstimate:
    """The partner said a keyframe more, off its way."""
    scene.partner.add(Keyframe(NEWEST + 10 + AHEAD, 0, 500 * 30, 20_000, 0))
    return estimate


def said_late(scene: Scene, estimate: TeamEstimate) -> TeamEstimate:
    """A keyframe of its way came late, and its wheels count otherwise than configured."""
    scene.partner.add(Keyframe(NEWEST - 5 + AHEAD, 0, 0, 30_000, 0))
    return estimate


def is_mounted_elsewhere(scene: Scene, estimate: TeamEstimate) -> TeamEstimate:
    scene.partner.take_model(1, RobotModel(EXACT, 2.0, 2.0, 1.4))
    return estimate


def was_solved_anew(scene: Scene, estimate: TeamEstimate) -> TeamEstimate:
    moved = Trajectory(Chain(PARTNER, 1), np.array([SOLVED + AHEAD]), W_PARTNER[None] + 0.5)
    return replace(estimate, trajectories={**estimate.trajectories, PARTNER: moved})


@pytest.mark.parametrize("change", [drove, said_late, is_mounted_elsewhere, was_solved_anew])
def test_a_partner_of_whom_something_is_new_is_looked_at_anew(
    change: Callable[[Scene, TeamEstimate], TeamEstimate],
) -> None:
    scene = Scene(end=NEWEST + 12)
    scene.hear(between() + 5.0, NEWEST - 3, NEWEST + 11)
    estimate = replace(solved(), yaw={PARTNER: Learned(0.2, 0.1)})
    scene.look(estimate)
    before = scene.watch._gap_m
    assert before > 1.0
    scene.look(estimate)
    assert scene.watch._gap_m == before
    estimate = change(scene, estimate)
    scene.look(estimate)
    first, scene.watch = scene.watch._gap_m, RangeWatch(SIGMA, LINKTRACK)
    scene.look(estimate)
    assert first == scene.watch._gap_m
    assert first != before
