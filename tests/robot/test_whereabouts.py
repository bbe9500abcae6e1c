"""A pose is valid for a second; then it grows old, and says so."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lab.recordings import world
from lab.score.metrics import at_times, relative
from teams import EASY, VirtualTeam

from drslamd import report
from drslamd.conventions import SECOND_US
from drslamd.gossip import messages
from drslamd.gossip.message_types import Pose, PoseState
from drslamd.slam.doubt import Doubt, Reason
from drslamd.slam.graph.estimate import PoseNow
from drslamd.slam.odometry.track import Track
from drslamd.slam.relocation.relocation import ANY_HEADING_RAD, ByRanges
from drslamd.whereabouts import NOWHERE, Whereabouts, likely_speeds, whereabouts

COVARIANCE = np.diag([0.09, 0.16, 0.01])
T0 = 1_000 * SECOND_US
DOUBT = Doubt(0, Reason.RANGES, (4,))


def a_track(*speeds_mps: float, turning: float = 0.0) -> Track:
    """One that drove so fast along x, 100 samples each; steps are tenths of millimetres."""
    track, x, n = Track(10_000), 0.0, 9_000
    for speed in speeds_mps:
        for _ in range(100):
            track.append(n, np.array([x, 0.0, turning * (n - 9_000) * 1e3]))
            x, n = x + speed * 1e3, n + 1
    return track


def after(
    age_us: int,
    track: Track | None = None,
    most_mps: float = 3.0,
    doubt: Doubt | None = None,
    gap_m: float = 0.0,
) -> Whereabouts:
    """What is said of a robot so long after its last pose."""
    found = PoseNow(T0, np.array([1.0, 2.0, 0.5]), COVARIANCE)
    return whereabouts(found, track or a_track(0.5), most_mps, doubt, T0 + age_us, gap_m)


# what a pose is worth


@pytest.mark.parametrize(
    ("age_us", "is_by_ranges"), [(None, True), (SECOND_US, False), (SECOND_US + 1, True)]
)
def test_a_position_by_ranges_stands_in_for_a_pose_that_is_old_or_none(
    age_us: int | None, is_by_ranges: bool
) -> None:
    by_ranges = ByRanges(PoseNow(T0, np.array([3.0, 4.0, 0.0]), np.eye(3)), 7 * SECOND_US)
    found = None
    if age_us is not None:
        found = PoseNow(T0 - age_us, np.array([1.0, 2.0, 0.5]), COVARIANCE)
    where = whereabouts(found, a_track(0.5), 3.0, None, T0, 0.0, by_ranges)
    assert (where.pose is by_ranges.pose) is is_by_ranges
    assert where.state is (PoseState.STALE if is_by_ranges else PoseState.LOCALISED)
    assert (where.age_us == 7 * SECOND_US) is is_by_ranges


@pytest.mark.parametrize("doubt", [None, DOUBT])
def test_what_stands_has_a_position_and_never_a_heading(doubt: Doubt | None) -> None:
    found = PoseNow(T0, np.array([1.0, 2.0, 0.5]), COVARIANCE)
    where = whereabouts(found, a_track(0.0), 3.0, doubt, T0, is_point=True)
    assert where.state is PoseState.POSITION


def test_who_has_no_pose_is_not_localised() -> None:
    assert whereabouts(None, a_track(0.5), 3.0, None, T0) == NOWHERE
    # nothing speaks against a pose that is none
    assert whereabouts(None, a_track(0.5), 3.0, DOUBT, T0) == NOWHERE
    assert NOWHERE.state is PoseState.NOT_LOCALISED


@pytest.mark.parametrize("age_us", [0, 100_000, SECOND_US])
def test_up_to_a_second_a_pose_is_what_it_was(age_us: int) -> None:
    where = after(age_us)
    assert where.state is PoseState.LOCALISED
    assert where.pose is not None
    assert (where.pose.utime, where.age_us) == (T0, age_us)
    assert np.array_equal(where.pose.covariance, COVARIANCE)


@pytest.mark.parametrize("age_us", [0, SECOND_US])
def test_what_is_doubted_is_said_with_its_reason_and_is_as_wide_as_it_was(age_us: int) -> None:
    where = after(age_us, doubt=DOUBT)
    assert where.state is PoseState.DOUBTFUL
    assert where.doubt is DOUBT
    assert not where.is_old
    assert where.pose is not None
    assert np.array_equal(where.pose.covariance, COVARIANCE)


@pytest.mark.parametrize("doubt", [None, DOUBT])
@pytest.mark.parametrize("age_us", [0, SECOND_US])
def test_a_pose_may_be_off_by_as_much_as_ranges_of_now_are_and_its_angle_is_as_it_was(
    age_us: int, doubt: Doubt | None
) -> None:
    where = after(age_us, doubt=doubt, gap_m=0.7)
    assert where.state is (PoseState.DOUBTFUL if doubt else PoseState.LOCALISED)
    assert where.pose is not None
    assert where.pose.covariance == pytest.approx(COVARIANCE + np.diag([0.49, 0.49, 0.0]))
    assert np.array_equal(where.pose.pose, [1.0, 2.0, 0.5])
    # what was given is left as it was
    assert COVARIANCE[0, 0] == 0.09


def test_what_was_ranged_says_nothing_of_an_old_pose() -> None:
    old, wide = after(3 * SECOND_US), after(3 * SECOND_US, gap_m=50.0)
    assert old.pose is not None
    assert wide.pose is not None
    assert wide.state is PoseState.STALE
    assert np.array_equal(wide.pose.covariance, old.pose.covariance)
    assert after(601 * SECOND_US, gap_m=50.0) == NOWHERE


def test_an_old_pose_is_old_whatever_was_doubted_of_it() -> None:
    where = after(SECOND_US + 1, doubt=DOUBT)
    assert where.state is PoseState.STALE
    assert where.doubt is None


@pytest.mark.parametrize("age_s", [1.000_001, 5.0, 19.0, 600.0])
def test_then_it_is_stale_and_may_be_off_by_all_that_was_driven_since(age_s: float) -> None:
    where = after(round(age_s * 1e6))
    assert where.state is PoseState.STALE
    assert where.is_old
    assert where.pose is not None
    assert where.pose.utime == (T0 + round(age_s * 1e6)) // 100_000 * 100_000
    assert np.array_equal(where.pose.pose, [1.0, 2.0, 0.5])
    way = 0.5 * age_s
    expected = COVARIANCE + np.diag([way**2, way**2, 0.0])
    assert where.pose.covariance == pytest.approx(expected, rel=1e-6)


def test_after_ten_minutes_without_odometry_a_robot_is_nowhere() -> None:
    assert after(600 * SECOND_US).state is PoseState.STALE
    assert after(600 * SECOND_US + 1) == NOWHERE


def test_its_heading_is_lost_as_fast_as_it_turned_and_never_more_than_wholly() -> None:
    track = a_track(0.5, turning=0.2)
    sigmas = []
    for seconds in (2, 4, 400):
        where = after(seconds * SECOND_US, track)
        assert where.pose is not None
        sigmas.append(math.sqrt(where.pose.covariance[2, 2] - 0.01))
    assert sigmas == pytest.approx([0.4, 0.8, math.pi / math.sqrt(3)])


# how far a robot can have come


def test_a_robot_drives_as_fast_as_in_its_fastest_second() -> None:
    speed, turning = likely_speeds(a_track(0.1, 0.7, 0.3), 3.0)
    assert speed == pytest.approx(0.7)
    assert turning == 0.0


def test_what_the_wheels_can_do_at_most_bounds_it() -> None:
    assert likely_speeds(a_track(0.7), 0.5)[0] == 0.5


def test_a_hole_in_the_track_is_no_speed() -> None:
    track = a_track(0.5)
    track.append(track.end + 5, np.array([9e6, 0.0, 0.0]))
    assert likely_speeds(track, 3.0)[0] == pytest.approx(0.5)


def test_what_was_driven_more_than_ten_minutes_ago_is_forgotten() -> None:
    track = a_track(0.9, *[0.2] * 59)
    assert likely_speeds(track, 3.0)[0] == pytest.approx(0.9)
    track = a_track(0.9, *[0.2] * 61)
    assert likely_speeds(track, 3.0)[0] == pytest.approx(0.2)


@pytest.mark.parametrize(("speed", "drives"), [(0.049, False), (0.051, True)])
def test_a_robot_that_has_not_driven_yet_may_do_what_its_wheels_can(
    speed: float, drives: bool
) -> None:
    found, _ = likely_speeds(a_track(speed), 3.0)
    assert found == pytest.approx(speed if drives else 3.0)


def test_a_robot_that_only_turned_on_the_spot_has_moved() -> None:
    speed, turning = likely_speeds(a_track(0.0, turning=0.3), 3.0)
    assert (speed, turning) == pytest.approx((0.0, 0.3))


# a wheel cable is pulled


OUT_S, BACK_S = 30.0, 50.0


@pytest.fixture(scope="module")
def team() -> VirtualTeam:
    """Robot 1 has no wheels from 30 to 50 s; others are as ever."""
    team = VirtualTeam(world.Scene(**{**EASY.__dict__, "seconds": 56.0}), on=())
    team.cut = lambda robot, port, t: robot == 1 and port == "wheels" and OUT_S < t < BACK_S
    for robot in range(3):
        team.start(robot)
    team.run(49.0)
    return team


def said(team: VirtualTeam, robot: int) -> list[tuple[float, float, Pose]]:
    """When poses were said, s, and how old each was, s."""
    member, out = team.member(robot), []
    for sent, channel, payload in member.traces.sent:
        if messages.kind_of_channel(channel) == "POSE":
            pose = messages.decode("POSE", payload)
            assert isinstance(pose, Pose)
            out.append((sent / 1e6, (member.clock.local(sent) - pose.pose_utime) / 1e6, pose))
    return out


@pytest.mark.slow
def test_no_pose_that_is_called_valid_is_older_than_a_second(team: VirtualTeam) -> None:
    poses = said(team, 1)
    assert max(age for _, age, pose in poses if pose.state == PoseState.LOCALISED) <= 1.0
    later = [pose.state for sent, _, pose in poses if sent > OUT_S + 1.2]
    assert set(later) == {PoseState.STALE}
    assert len(later) >= 15


@pytest.mark.slow
def test_meanwhile_ranges_say_where_it_is_and_nobody_knows_how_it_stands(
    team: VirtualTeam,
) -> None:
    trails, member = team.recording.trails, team.member(1)
    looks = [pose for sent, _, pose in said(team, 1) if sent > OUT_S + 3.2]
    assert len(looks) >= 15
    errors = []
    for pose in looks:
        t = np.array([member.clock.world(pose.pose_utime) / 1e6])
        true = at_times(trails[1].t, trails[1].truth, t)[0]
        error = (np.array(pose.pose) - relative(trails[0].truth[0], true))[:2]
        xx, xy, _, yy, _, tt = pose.covariance
        assert error @ np.linalg.solve([[xx, xy], [xy, yy]], error) < 16
        assert math.sqrt(tt) == pytest.approx(ANY_HEADING_RAD, rel=1e-3)
        errors.append(float(np.hypot(*error)))
    assert np.median(errors) < 0.5


@pytest.mark.slow
def test_status_says_that_the_pose_is_stale_and_what_is_wrong(team: VirtualTeam) -> None:
    member = team.member(1)
    utime = member.clock.local(team.simulator.now)
    pose = report.status(member.robot, utime)["pose"]
    assert pose["state"] == "stale"
    assert pose["age_s"] == pytest.approx(19.0, abs=0.2)
    assert pose["sigma_deg"] > 100
    assert "no odometry for 19 s: the position is that of ranges" in team.problems(1)


@pytest.mark.slow
def test_the_others_hear_that_it_is_stale(team: VirtualTeam) -> None:
    for robot in (0, 2):
        member = team.member(robot)
        peers = report.status(member.robot, member.clock.local(team.simulator.now))["peers"]
        assert peers["1"]["pose"] == "stale"
        other = str(2 - robot)
        assert peers[other]["pose"] == "localised"


@pytest.mark.slow
def test_the_poses_of_the_others_stay_valid(team: VirtualTeam) -> None:
    for robot in (0, 2):
        states = {pose.state for sent, _, pose in said(team, robot) if sent > OUT_S}
        assert states == {PoseState.LOCALISED}


@pytest.mark.slow
def test_when_the_cable_is_back_it_waits_for_its_heading(team: VirtualTeam) -> None:
    team.run(BACK_S + 2)
    member = team.member(1)
    utime = member.clock.local(team.simulator.now)
    assert report.status(member.robot, utime)["pose"]["state"] == "stale"
    assert "odometry was interrupted" in team.problems(1)
    assert {pose.state for sent, _, pose in said(team, 1) if sent > BACK_S} == {PoseState.STALE}


@pytest.mark.slow
def test_a_robot_alone_says_that_its_pose_grew_old_though_nothing_is_solved() -> None:
    team = VirtualTeam(EASY, on=())
    team.cut = lambda robot, port, t: robot == 1 and t > OUT_S
    for robot in range(3):
        team.start(robot)
    team.run(OUT_S)
    for robot in (0, 2):
        team.simulator.kill(team.member(robot))
    team.run(OUT_S + 4)
    states = [pose.state for sent, _, pose in said(team, 1) if sent > OUT_S + 1.5]
    assert states
    assert set(states) == {PoseState.STALE}
