"""A long play put aside on the disk and taken up again, perhaps by another process.

Everything in a play is plain data but for what will happen when: functions in functions, which
`cloudpickle` can write. Only the code that wrote a file can go on with it, so a mark, say of the
commit, is asked for.
"""

from __future__ import annotations

import os
import pickle
from pathlib import Path
from typing import Any

import cloudpickle


def put_aside(path: Path, play: Any, mark: object) -> None:
    """Write a play; what was there before stays until this one is whole.

    Args:
        mark: what whoever takes it up has to know; a picklable value with `==`.
    """
    fresh = path.with_name(path.name + ".new")
    fresh.write_bytes(pickle.dumps(mark) + cloudpickle.dumps(play))
    os.replace(fresh, path)


def taken_up(path: Path, mark: object) -> Any | None:
    """The play that was put aside under this mark; None where there is none.

    The file is one that `put_aside` wrote on this computer: what strangers send is never read here.
    """
    if not path.exists():
        return None
    with path.open("rb") as file:
        return pickle.load(file) if pickle.load(file) == mark else None
