"""A run once more: the same events into the same program, and is all that it did the same?"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from drslamd.conventions import SECOND_US
from drslamd.events import Effect, Event, JobDone, Send, Solve
from drslamd.recording import digest
from drslamd.recording.records import Beginning, Marked, Opening, Sent, Told
from drslamd.robot import Robot
from lab.replay.runs import Run, make_robot


@dataclass(frozen=True)
class Difference:
    """The first one: when, seconds from the beginning, and what."""

    at_s: float
    what: str


@dataclass
class Replayed:
    """What came of it.

    Attributes:
        robot: as it is at the end.
        utime: of the last event.
        ended: why it was not followed to the end; empty when it was.
    """

    robot: Robot
    utime: int
    difference: Difference | None = None
    ended: str = ""
    events: int = 0
    sends: int = 0
    jobs: int = 0
    seconds: float = 0.0


class Replayer:
    """Follows one run.

    Attributes:
        found: so far.
    """

    def __init__(self, run: Run, key: bytes) -> None:
        self._run, self._key, self._config = run, key, run.config()
        self.found = Replayed(self._begun(run.opening.beginning), run.opening.utime)
        self._began = run.opening.utime

    def _begun(self, beginning: Beginning) -> Robot:
        self._results: dict[int, Any] = {}
        self._due: deque[Send] = deque()
        return make_robot(self._config, self._run, self._key, beginning)

    def follow(
        self,
        progress: Callable[[float], None] | None = None,
        is_checked: bool = True,
        until_s: float = math.inf,
    ) -> Replayed:
        """Replay it up to its end, or to what is missing in it.

        Args:
            progress: told the seconds that have passed.
            is_checked: end at the first difference.
            until_s: end at this time from its beginning.
        """
        self._digest = self._run.opening.digest
        for record in self._run.records():
            if isinstance(record, Opening):
                self._expect("what was done up to the next file", record.digest, self._digest)
            elif isinstance(record, Beginning):
                self.found.robot = self._begun(record)
            elif isinstance(record, Told):
                if record.kind == "gap":
                    self.found.ended = "events are missing here; what follows cannot be replayed"
                    break
            elif isinstance(record, Sent):
                self._on_sent(record.send)
            else:
                self._on_event(record)
            if progress:
                progress(self.found.seconds)
            is_wrong = is_checked and self.found.difference is not None
            if is_wrong or self.found.seconds >= until_s:
                break
        return self.found

    def _on_event(self, record: Event | Marked) -> None:
        event: Event = record.event if isinstance(record, Marked) else record
        if self._due:
            self._differs(f"sends on {self._due[0].channel}, which was not sent then")
            self._due.clear()
        self.found.utime = event.utime
        self.found.seconds = (event.utime - self._began) / SECOND_US
        if isinstance(record, Marked):
            if isinstance(event, JobDone):
                if event.job_id not in self._results:
                    self._differs(f"computation {event.job_id} was not begun")
                    return
                name, result = self._results.pop(event.job_id)
                what = f"the result of computation {event.job_id} ({name})"
                self._expect(what, record.digest, digest.of_result(result))
                event = replace(event, result=result)
                self.found.jobs += 1
            else:
                what = "what was done since the last tick beside messages (notes, polls, jobs)"
                self._expect(what, record.digest, self._digest)
        self.found.events += 1
        for effect in self.found.robot.handle(event):
            self._on_effect(effect)

    def _on_effect(self, effect: Effect) -> None:
        self._digest = digest.of_effect(effect, self._digest)
        if isinstance(effect, Send):
            self._due.append(effect)
        elif isinstance(effect, Solve):
            self._results[effect.job_id] = effect.name, effect.run()

    def _on_sent(self, sent: Send) -> None:
        self.found.sends += 1
        again = self._due.popleft() if self._due else None
        if again is None:
            self._differs(f"does not send on {sent.channel}, which was sent then")
        elif again.channel != sent.channel:
            self._differs(f"sends on {again.channel} what was sent on {sent.channel}")
        elif again != sent:
            self._differs(f"sends other {len(again.payload)} bytes on {sent.channel}")

    def _expect(self, what: str, before: int, now: int) -> None:
        if before != now:
            self._differs(f"{what} is not the same")

    def _differs(self, what: str) -> None:
        if self.found.difference is None:
            self.found.difference = Difference(self.found.seconds, what)
