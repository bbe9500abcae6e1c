"""The pieces of the work: all of them, under names that a state can be kept by."""

from __future__ import annotations

from collections import Counter

from lab.reproduce import plan


def test_every_seed_has_every_piece_and_no_name_comes_twice() -> None:
    names = [piece.name for piece in plan.full(6)]
    assert len(set(names)) == len(names)
    kinds = Counter(name.split("/")[0] for name in names)
    seeds = {"table1": 6, "table2": 6, "central": 6, "team": 6, "efficiency": 18}
    assert kinds == {**seeds, "sweeps": 4, "table4": 4}


def test_names_of_a_quick_run_are_not_those_of_a_full_one() -> None:
    assert not {p.name for p in plan.quick()} & {p.name for p in plan.full(20)}


def test_a_quick_run_is_under_three_minutes_by_its_own_account() -> None:
    assert sum(piece.seconds for piece in plan.quick()) < 180


def test_the_rival_is_scored_at_all_pose_times() -> None:
    tally = plan.full(1)[2].run()
    assert tally["central/m"].n == 999
    assert tally["central/ate"].n == 1
