"""What is cut out of a DBC file; what it is good for is tested with the driver, in test_dbc."""

from __future__ import annotations

import pytest

from drslamd.config import ConfigError
from drslamd.sensors.wheels.dbc_file import decoded, messages_of

TEXT = (
    'VERSION ""\nBO_ 1 A: 8 X\n SG_ B : 0|8@1+ (1,0) [0|0] "" X\n SG_ C : 0|8@1+ (1,0) [0|0] "" X\n'
)


def test_only_the_signals_asked_for_are_read() -> None:
    pytest.importorskip("cantools")
    message = messages_of(TEXT, {"left": "A.B"})["left"]
    assert [signal.name for signal in message.signals] == ["B"]


def test_a_file_without_messages_is_one_sentence() -> None:
    with pytest.raises(ConfigError, match="no line that begins with BO_"):
        messages_of("text", {"left": "A.B"})


def test_bytes_that_are_no_text_are_refused() -> None:
    with pytest.raises(ValueError, match="not a text file"):
        decoded(b"A\0\0BC")
