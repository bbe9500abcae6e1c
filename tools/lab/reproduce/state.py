"""What was computed so far, in a file: a long run that was broken off goes on where it stopped."""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path

import drslamd
import lab
from lab.reproduce.tally import Sums, Tally

SOURCES = (Path(drslamd.__file__).parent, Path(lab.__file__).parent)


def fingerprint() -> str:
    """Of all code that a result depends on: other code gives other results."""
    digest = hashlib.blake2b(digest_size=8)
    for folder in SOURCES:
        for path in sorted(folder.rglob("*.py")):
            digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()


class State:
    """Tallies by the name of the piece of work that made them."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._code = fingerprint()
        self.done: dict[str, dict[str, Sums]] = {}
        self.stale = False
        """There was a file, but made by other code."""
        try:
            held = json.loads(path.read_text())
            if held["code"] == self._code:
                self.done = held["done"]
            else:
                self.stale = True
        except FileNotFoundError:
            return
        except (ValueError, KeyError, TypeError):
            self.stale = True

    def keep(self, name: str, tally: Tally) -> None:
        """Add one result, and write all of them whole or not at all."""
        self.done[name] = tally.sums
        self._path.parent.mkdir(parents=True, exist_ok=True)
        beside = self._path.with_suffix(".new")
        beside.write_text(json.dumps({"code": self._code, "done": self.done}))
        os.replace(beside, self._path)

    def total(self, names: list[str]) -> Tally:
        """All results of these pieces together."""
        tally = Tally()
        for name in names:
            tally.merge(self.done.get(name, {}))
        return tally
