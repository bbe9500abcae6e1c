"""Programs that are timed in turns."""

from __future__ import annotations

from lab.benchmark import timing


def test_programs_take_turns_and_the_first_round_does_not_count() -> None:
    calls: list[str] = []
    programs = {name: (lambda name=name: calls.append(name)) for name in ("a", "b")}
    times = timing.in_turns(programs, 3, 10.0)
    assert calls == ["a", "b"] * 4
    assert times["a"].count == times["b"].count == 3


def test_what_is_too_slow_is_run_less_often() -> None:
    times = timing.in_turns({"slow": lambda: sum(range(1_000_000))}, 1000, 0.05)
    assert 1 <= times["slow"].count < 100
    assert 0 < times["slow"].median <= times["slow"].p99
