"""Computations under way, and how long a module rests after one."""

from __future__ import annotations

import pytest
from pair_scenes import asked_at, tracker

from drslamd.conventions import SECOND_US, Chain
from drslamd.events import JobDone
from drslamd.jobs import (
    CONSISTENCY,
    LIGHT_US,
    OPTIMIZER,
    RELATIVE_POSE,
    REST,
    DutyCycle,
    Job,
    Jobs,
)
from drslamd.slam.consistency.pair import Agreement, PairTracker

T0 = 100 * SECOND_US
TOOK = 100_000


def a_pair(robot: int) -> PairTracker:
    return tracker(Chain(robot, 1), Agreement(5, 2, confirms=False))


def done(jobs: Jobs, job: Job, ended: int = T0, took: int = TOOK) -> Job:
    """A job that has just been computed."""
    solve = jobs.begin(job, lambda: None)
    return jobs.finish(JobDone(ended, solve.job_id, None, took))


def test_a_job_goes_out_under_the_name_of_its_module_and_comes_back_by_its_number() -> None:
    jobs, pair, request = Jobs(), a_pair(1), asked_at(10)
    first = Job(RELATIVE_POSE, (pair,), (request,))
    effects = [jobs.begin(first, lambda: "answer"), jobs.begin(Job(OPTIMIZER), lambda: None)]
    assert [effect.name for effect in effects] == [RELATIVE_POSE, OPTIMIZER]
    assert effects[0].job_id != effects[1].job_id
    assert effects[0].run() == "answer"
    assert jobs.finish(JobDone(T0, effects[1].job_id, None, 1)) == Job(OPTIMIZER)
    assert jobs.finish(JobDone(T0, effects[0].job_id, None, 1)) is first


def test_a_module_is_busy_until_its_job_has_ended() -> None:
    jobs = Jobs()
    assert not jobs.is_busy(OPTIMIZER)
    solve = jobs.begin(Job(OPTIMIZER), lambda: None)
    assert jobs.is_busy(OPTIMIZER)
    assert not jobs.is_busy(CONSISTENCY)
    jobs.finish(JobDone(T0, solve.job_id, None, TOOK))
    assert not jobs.is_busy(OPTIMIZER)


def test_a_module_is_busy_with_one_pair_and_free_for_another() -> None:
    jobs, one, other = Jobs(), a_pair(1), a_pair(2)
    first = jobs.begin(Job(RELATIVE_POSE, (one,)), lambda: None)
    assert jobs.is_busy(RELATIVE_POSE, one)
    assert not jobs.is_busy(RELATIVE_POSE, other)
    assert not jobs.is_busy(CONSISTENCY, one)
    assert jobs.is_busy(RELATIVE_POSE)
    jobs.begin(Job(RELATIVE_POSE, (other,)), lambda: None)
    jobs.finish(JobDone(T0, first.job_id, None, TOOK))
    assert not jobs.is_busy(RELATIVE_POSE, one)
    assert jobs.is_busy(RELATIVE_POSE)


@pytest.mark.parametrize(("after", "is_resting"), [(4 * TOOK - 1, True), (4 * TOOK, False)])
def test_a_module_rests_four_times_as_long_as_it_computed(after: int, is_resting: bool) -> None:
    jobs = Jobs()
    assert not jobs.is_resting(OPTIMIZER, T0)
    done(jobs, Job(OPTIMIZER))
    assert jobs.is_resting(OPTIMIZER, T0 + after) is is_resting
    assert not jobs.is_resting(RELATIVE_POSE, T0)


def test_so_it_takes_a_fifth_of_a_core_at_most() -> None:
    jobs, utime, computed = Jobs(), T0, 0
    while utime < T0 + 100 * SECOND_US:
        if jobs.is_resting(OPTIMIZER, utime):
            utime += 10_000
            continue
        utime += TOOK
        computed += TOOK
        done(jobs, Job(OPTIMIZER), ended=utime)
    assert computed / (utime - T0) == pytest.approx(1 / (1 + REST), abs=0.01)


@pytest.mark.parametrize(
    ("took", "every"),
    [(100_000, 500_000), (200_000, SECOND_US), (LIGHT_US, SECOND_US), (LIGHT_US + 1, 1_666_670)],
)
def test_the_team_is_solved_every_second_where_that_takes_a_third_of_it(
    took: int, every: int
) -> None:
    jobs = Jobs()
    done(jobs, Job(OPTIMIZER), took=took)
    since, until = jobs.cycles[OPTIMIZER]
    assert until - since == every
    # of the other modules none has such a right
    done(jobs, Job(CONSISTENCY), took=took)
    since, until = jobs.cycles[CONSISTENCY]
    assert until - since == (1 + REST) * took


def test_a_cycle_is_from_the_begin_of_a_computation_to_the_end_of_its_rest() -> None:
    jobs = Jobs()
    done(jobs, Job(OPTIMIZER))
    assert jobs.cycles == {OPTIMIZER: DutyCycle(T0 - TOOK, T0 + 4 * TOOK)}


@pytest.mark.parametrize(("before_its_end", "is_one_cycle"), [(0, False), (1, True)])
def test_what_begins_after_the_rest_is_a_new_cycle(before_its_end: int, is_one_cycle: bool) -> None:
    jobs = Jobs()
    done(jobs, Job(RELATIVE_POSE, (a_pair(1),)))
    rested = T0 + 4 * TOOK
    ended = rested - before_its_end + TOOK
    done(jobs, Job(RELATIVE_POSE, (a_pair(2),)), ended=ended)
    since, until = jobs.cycles[RELATIVE_POSE]
    assert since == (T0 - TOOK if is_one_cycle else rested)
    assert until == ended + 4 * TOOK


def test_pairs_that_are_computed_one_after_the_other_rest_for_all_of_them() -> None:
    """Three windows of one round, each 0.1 s: 0.3 s of computing and 1.2 s of rest."""
    jobs = Jobs()
    solves = [jobs.begin(Job(RELATIVE_POSE, (a_pair(k),)), lambda: None) for k in range(3)]
    for k, solve in enumerate(solves, start=1):
        jobs.finish(JobDone(T0 + k * TOOK, solve.job_id, None, TOOK))
    since, until = jobs.cycles[RELATIVE_POSE]
    assert since == T0
    assert until == T0 + TOOK + 3 * REST * TOOK


def test_a_module_is_free_when_it_neither_computes_nor_rests() -> None:
    jobs = Jobs()
    assert jobs.is_free(OPTIMIZER, T0)
    solve = jobs.begin(Job(OPTIMIZER), lambda: None)
    assert not jobs.is_free(OPTIMIZER, T0)
    assert jobs.is_free(RELATIVE_POSE, T0)
    jobs.finish(JobDone(T0, solve.job_id, None, TOOK))
    assert not jobs.is_free(OPTIMIZER, T0 + REST * TOOK - 1)
    assert jobs.is_free(OPTIMIZER, T0 + REST * TOOK)
