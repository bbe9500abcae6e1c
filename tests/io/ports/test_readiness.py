"""Whether there is anything to read, asked of real descriptors."""

from __future__ import annotations

import os

from drslamd.io.ports.readiness import has_bytes


def test_a_pipe_says_something_once_bytes_wait_or_nobody_writes_any_more() -> None:
    reader, writer = os.pipe()
    assert not has_bytes(reader)
    os.write(writer, b"x")
    assert has_bytes(reader)
    os.read(reader, 1)
    assert not has_bytes(reader)
    os.close(writer)
    assert has_bytes(reader)
    os.close(reader)


def test_where_there_is_no_descriptor_there_is_nothing_to_read() -> None:
    assert not has_bytes(-1)
