"""How a program ends where nothing else says it: a signal, nobody who reads on, a bug."""

from __future__ import annotations

import errno
import os
import signal
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

_UNWRITABLE = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO}
"""Of a standard output that goes into a file."""


def in_order(action: Callable[[], int], *, unwritable: int, bug: int) -> int:
    """Run it; the exit code.

    Whoever reads may have enough, as ``head`` has, and a person may press Ctrl-C at any time: both
    end the program by the signal that other programs end by, so that a shell does not go on with
    its loop and takes no half an answer for a verdict.

    Args:
        unwritable: the code where the standard output takes no more; bug: of any other exception.
    """
    try:
        try:
            return action()
        finally:
            if sys.stdout is not None:
                sys.stdout.flush()  # here, and not where Python ends and nobody can be told
    except BrokenPipeError:
        return _die_of(signal.SIGPIPE)
    except KeyboardInterrupt:
        return _die_of(signal.SIGINT)
    except Exception as error:
        if _is_unwritable(error):
            _silence()
            print(f"what there is to say cannot be written: {error}; make room", file=sys.stderr)
            return unwritable
        traceback.print_exc()
        print("this is a bug; please report the lines above", file=sys.stderr)
        return bug


@contextmanager
def ended_by_a_signal() -> Iterator[None]:
    """SIGTERM and a terminal that is closed end it as Ctrl-C does, so that what was begun is put in
    order.
    """
    numbers = [number for number in stops() if number is not signal.SIGINT]
    before = [signal.signal(number, signal.default_int_handler) for number in numbers]
    try:
        yield
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)


def stops() -> list[signal.Signals]:
    """The signals that ask a program to stop. SIGHUP says that its terminal was closed, unless
    nohup made it mean nothing.
    """
    asked = [signal.SIGTERM, signal.SIGINT]
    is_told = signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN
    return [*asked, signal.SIGHUP] if is_told else asked


def _is_unwritable(error: Exception) -> bool:
    """Did the standard output refuse what was printed? Files that a verb makes have names."""
    return isinstance(error, OSError) and error.errno in _UNWRITABLE and error.filename is None


def _die_of(number: signal.Signals) -> int:
    signal.signal(number, signal.SIG_DFL)
    os.kill(os.getpid(), number)
    return 128 + number  # where the signal is blocked


def _silence() -> None:
    """What is still in the buffer shall not fail once more when Python ends."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
