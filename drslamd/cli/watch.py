"""``drslamd status --watch``: the picture of a running daemon, anew each second."""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from drslamd.cli.ask import NoAnswer, answer
from drslamd.cli.exit_codes import OK
from drslamd.host.ending import ended_by_a_signal
from drslamd.reports.status_table import fitted, table

PERIOD_S = 1.0
ENTER = "\x1b[?1049h\x1b[?25l"
"""The second screen of a terminal, without a cursor (xterm control sequences, DECSET)."""
LEAVE = "\x1b[?25h\x1b[?1049l"
HOME, REST_OF_LINE, REST_OF_SCREEN = "\x1b[H", "\x1b[K", "\x1b[J"


def watch(path: Path, config_path: str, sleep: Callable[[float], object] = time.sleep) -> int:
    """Until Ctrl-C: a live table in a terminal, elsewhere a block of lines each second.

    Raises:
        NoAnswer: no daemon answered even once.
    """
    show = _draw if sys.stdout.isatty() else _print
    picture, before, then = answer(path, "status", config_path), None, 0.0
    with ended_by_a_signal(), _screen():
        try:
            while True:
                now = time.monotonic()
                show(_lines(picture, before, now - then))
                before, then = picture if isinstance(picture, dict) else before, now
                sleep(PERIOD_S)
                picture = _try_again(path, config_path)
        except (KeyboardInterrupt, BrokenPipeError):
            return OK


def _try_again(path: Path, config_path: str) -> Any:
    """The next answer, or why none came: the daemon may be about to start again."""
    try:
        return answer(path, "status", config_path)
    except NoAnswer as error:
        return str(error)


def _lines(picture: Any, before: dict[str, Any] | None, seconds: float) -> list[str]:
    if isinstance(picture, str):
        return [picture]
    same = before is not None and before["epoch"] == picture["epoch"]
    clock = time.strftime("%H:%M:%S")
    return [clock, *table(picture, before if same else None, seconds)]


def _draw(lines: list[str]) -> None:
    shown = fitted(lines, *shutil.get_terminal_size())
    end = f"{REST_OF_LINE}\r\n"
    sys.stdout.write(HOME + end.join(shown) + REST_OF_LINE + REST_OF_SCREEN)
    sys.stdout.flush()


def _print(lines: list[str]) -> None:
    print("\n".join([*lines, ""]), flush=True)


@contextmanager
def _screen() -> Iterator[None]:
    """The second screen of a terminal, and the first one again, whatever happens."""
    if not sys.stdout.isatty():
        yield
        return
    sys.stdout.write(ENTER)
    try:
        yield
    finally:
        sys.stdout.write(LEAVE)
        sys.stdout.flush()
