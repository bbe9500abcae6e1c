"""Pose and peers over a local socket."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

from daemon_scenes import Stepped
from near_scenes import Steered

from drslamd.io.near_socket import MOST_READERS, NearSocket, connected
from drslamd.near import near_message


def played(scene: Any) -> None:
    asyncio.run(asyncio.wait_for(scene(), 10))


def steered() -> Steered:
    robot = Steered()
    robot.drive(20)
    robot.solve()
    return robot


def test_a_reader_gets_one_message_for_each_sample(tmp_path: Path) -> None:
    async def scene() -> None:
        robot, near = steered(), NearSocket(tmp_path / "near", Stepped())
        assert near.open() == ""
        assert not near.has_readers
        with connected(tmp_path / "near") as reader:
            await asyncio.sleep(0)
            await asyncio.sleep(0)
            assert near.has_readers
            for _ in range(3):
                robot.drive(1)
                near.tell(robot.robot.near)
                near.tell(robot.robot.near)
            found = [near_message.decode(reader.recv(1 << 16)) for _ in range(3)]
            near.close()
            assert reader.recv(1) == b""
            assert not near.has_readers
        assert [f.utime for f in found if isinstance(f, near_message.Near)] == [
            robot.utime - 40_000,
            robot.utime - 20_000,
            robot.utime,
        ]
        assert isinstance(found[0], near_message.Near)
        assert found[0].utc_minus_clock_us > 0
        assert not (tmp_path / "near").exists()

    played(scene)


def test_nothing_is_worked_out_while_nobody_reads(tmp_path: Path) -> None:
    async def scene() -> None:
        robot, near = steered(), NearSocket(tmp_path / "near", Stepped())
        near.open()
        robot.robot.near.look = None  # type: ignore[assignment, method-assign]
        near.tell(robot.robot.near)
        near.close()

    played(scene)


def test_who_does_not_read_loses_and_does_not_stop_the_others(tmp_path: Path) -> None:
    async def scene() -> None:
        robot, near = steered(), NearSocket(tmp_path / "near", Stepped())
        near.open()
        with connected(tmp_path / "near"):
            await asyncio.sleep(0.01)
            while not near.lost:
                robot.drive(1)
                near.tell(robot.robot.near)
        near.close()

    played(scene)


def test_readers_beyond_the_most_are_turned_away_and_gone_ones_make_room(tmp_path: Path) -> None:
    async def scene() -> None:
        near = NearSocket(tmp_path / "near", Stepped())
        near.open()
        readers = [connected(tmp_path / "near") for _ in range(MOST_READERS)]
        await asyncio.sleep(0.05)
        with connected(tmp_path / "near") as late:
            await asyncio.sleep(0.05)
            assert late.recv(1) == b""
        readers.pop().close()
        await asyncio.sleep(0.05)
        readers.append(connected(tmp_path / "near"))
        await asyncio.sleep(0.05)
        assert len(near._readers) == MOST_READERS
        near.close()
        for reader in readers:
            reader.close()

    played(scene)


def test_a_path_that_cannot_be_is_one_sentence(tmp_path: Path) -> None:
    async def scene() -> None:
        near = NearSocket(tmp_path / ("x" * 120), Stepped())
        assert "cannot listen at" in near.open()
        near.close()

    played(scene)
