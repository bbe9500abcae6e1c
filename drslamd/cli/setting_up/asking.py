"""Questions to a person at a terminal; where there is none, nobody is asked."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import TypeVar

Answer = TypeVar("Answer")

TRIES = 5
"""Wrong answers; then nobody understands the question."""


class NobodyAnswers(Exception):
    """Nobody answers, or nobody can."""


def is_a_person_there() -> bool:
    return sys.stdin.isatty() and sys.stderr.isatty()


def ask(question: str, meant: Callable[[str], Answer], default: str = "") -> Answer:
    """What a person answers.

    Args:
        meant: turns a line into an answer; raises ValueError with a sentence about a wrong one.

    Raises:
        NobodyAnswers: end of input, or nothing but wrong answers.
    """
    shown = f"{question} [{default}]: " if default else f"{question}: "
    for _ in range(TRIES):
        print(shown, end="", file=sys.stderr, flush=True)
        line = sys.stdin.readline()
        if not line:
            break
        try:
            return meant(line.strip() or default)
        except ValueError as error:
            print(f"  {error}", file=sys.stderr)
    raise NobodyAnswers


def one_of(choices: Sequence[str]) -> Callable[[str], str]:
    """A choice by its number, from 1, or by its name; anything else that is no number is itself
    taken, as a port that is not plugged in is."""

    def meant(line: str) -> str:
        if line.isdecimal():
            if not 1 <= int(line) <= len(choices):
                raise ValueError(f"1 to {len(choices)}")
            return choices[int(line) - 1]
        if not line:
            raise ValueError("a number or a name")
        return line

    return meant


def show(choices: Sequence[str]) -> None:
    """Number them."""
    for number, choice in enumerate(choices, 1):
        print(f"  {number}  {choice}", file=sys.stderr)
