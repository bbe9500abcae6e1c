"""What the world may deny a build, and the exit code of each."""

from __future__ import annotations

MISSING, FAILED = 69, 1


class Unbuilt(Exception):
    """There is no package, and the sentence says why."""

    def __init__(self, sentence: str, code: int = FAILED) -> None:
        super().__init__(sentence)
        self.code = code
