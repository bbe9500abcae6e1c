"""Bits of a frame as numbers, against cantools."""

from __future__ import annotations

import random

import pytest

from drslamd.sensors.wheels.dbc_file import messages_of
from drslamd.sensors.wheels.wheel_driver import WheelRefusal

cantools = pytest.importorskip("cantools")

from drslamd.sensors.wheels.dbc_signal import SignalReader  # noqa: E402


def test_random_signals_are_what_cantools_reads() -> None:
    draw = random.Random(5)
    for _ in range(300):
        length = draw.randint(1, 64)
        order, sign = draw.choice("01"), draw.choice("+-")
        row = draw.randint(0, 64 - length)
        start = row if order == "1" else 8 * (row // 8) + 7 - row % 8
        text = (
            'VERSION ""\nNS_ :\nBS_:\nBU_: X\nBO_ 1 A: 8 X\n'
            f' SG_ B : {start}|{length}@{order}{sign} (0.5,-3) [0|0] "" X\n'
        )
        data = draw.randbytes(8)
        reader = SignalReader(messages_of(text, {"left": "A.B"})["left"], "B")
        message = cantools.database.load_string(text, "dbc").messages[0]
        assert reader.raw(data) == message.decode(data, scaling=False)["B"]
        assert reader.scaled(data) == message.decode(data)["B"]
        short = data[: (row + length - 1) // 8]
        assert reader.raw(short) is WheelRefusal.SHORT
