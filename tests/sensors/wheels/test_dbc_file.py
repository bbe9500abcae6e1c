"""What is cut out of a DBC file; what it is good for is tested with the driver, in test_dbc."""

from __future__ import annotations

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drslamd.config import ConfigError
from drslamd.sensors.wheels.dbc_file import decoded, messages_of
from drslamd.sensors.wheels.dbc_signal import SignalReader

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


PAGED = (
    'VERSION ""\nBO_ 1 A: 8 X\n SG_ I M : 0|4@1+ (1,0) [0|0] "" X\n'
    ' SG_ B m0 : 8|16@1+ (1,0) [0|0] "" X\nSG_MUL_VAL_ 1 B I 0-0;\n'
)


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        (" SG_ I M :", " I M :", "B is on a page of I, which is no signal of the DBC file"),
        (" SG_ I M :", " SG_ I M ,", "B is on a page of I, which is no signal of the DBC file"),
    ],
)
def test_a_signal_that_cannot_be_found_in_a_frame_is_one_sentence(
    old: str, new: str, fault: str
) -> None:
    pytest.importorskip("cantools")
    assert messages_of(PAGED, {"left": "A.B"})
    with pytest.raises(ConfigError, match=rf'^wheels.left = "A.B": {fault}; correct the file'):
        messages_of(PAGED.replace(old, new), {"left": "A.B"})


def test_bits_before_the_first_are_one_sentence() -> None:
    pytest.importorskip("cantools")
    with pytest.raises(ConfigError, match="B has 8 bits from bit -1 on; correct the file"):
        messages_of(TEXT.replace("0|8", "-1|8"), {"left": "A.B"})


TOKENS = re.compile(r"\d+|\w+|\S|\s")
ODD = ["0", "-1", "64", "99999999999999999999", "1e308", "m0", "M", '"', "|", "@", ":", ";", "\n",
       "SG_", "BO_", "A", "B", "I", "nan", "-", ","]  # fmt: skip


@settings(derandomize=True, max_examples=150, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 200), st.sampled_from([*ODD, ""])), max_size=3))
def test_whatever_was_changed_in_a_file_it_is_read_or_refused(
    changes: list[tuple[int, str]],
) -> None:
    pytest.importorskip("cantools")
    tokens = TOKENS.findall(PAGED)
    for at, new in changes:
        tokens[at % len(tokens)] = new
    try:
        message = messages_of("".join(tokens), {"left": "A.B"})["left"]
    except ConfigError:
        return
    for data in (b"", bytes(8), b"\xff" * 8):
        SignalReader(message, "B").raw(data)
        SignalReader(message, "B").scaled(data)


def test_bytes_that_are_no_text_are_refused() -> None:
    with pytest.raises(ValueError, match="not a text file"):
        decoded(b"A\0\0BC")
