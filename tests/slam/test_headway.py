"""Long solves leave marks, often enough for a watchdog of four seconds."""

from __future__ import annotations

import threading

from drslamd.slam import headway


def test_each_mark_changes_the_number() -> None:
    before = headway.marks()
    assert headway.marks() == before
    headway.mark()
    assert headway.marks() == before + 1


def test_marks_of_another_thread_count() -> None:
    before = headway.marks()
    thread = threading.Thread(target=headway.mark)
    thread.start()
    thread.join()
    assert headway.marks() > before
