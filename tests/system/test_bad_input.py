"""A real daemon and all that a workshop does to it: a clear word, nothing lost, no crash."""

from __future__ import annotations

import asyncio
import os
import socket
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Any

import numpy as np
import pytest
from lab.play.emulators import as_heard_at
from lab.play.real_team import GROUP, RealRobot, RealTeam
from lab.recordings import world
from message_builders import a_status, an_entry, forged

from drslamd.gossip import lc02
from drslamd.gossip.message_types import Heard, LogState, Message, OdometryBatch
from drslamd.gossip.seal import team_key
from drslamd.io.ports.reading_round import PERIOD_S
from drslamd.io.state_store import StateStore
from drslamd.io.status_socket import ask

pytestmark = pytest.mark.slow

SCENE = world.Scene(robots=1, seconds=20.0, odometry_hz=50)


@asynccontextmanager
async def daemon() -> AsyncIterator[tuple[RealTeam, RealRobot]]:
    """One robot whose devices print what the test writes."""
    async with RealTeam(world.simulate(SCENE, 0)) as team:
        yield team, team.robots[0]


def with_daemon(test: Callable[[RealTeam, RealRobot], Awaitable[None]]) -> None:
    async def run() -> None:
        async with daemon() as (team, robot):
            await asyncio.wait_for(test(team, robot), 60)
            assert robot.process is not None
            assert robot.process.returncode is None, robot.log.read_text()
        assert robot.process.returncode == 0

    asyncio.run(run())


async def status(robot: RealRobot) -> dict[str, Any]:
    answer: dict[str, Any] = await ask(robot.socket, "status")
    return answer


async def until(robot: RealRobot, what: Callable[[dict[str, Any]], bool], within_s: float) -> None:
    """Ask until it is so."""
    for _ in range(int(within_s / 0.1)):
        if what(await status(robot)):
            return
        await asyncio.sleep(0.1)
    raise AssertionError(f"not within {within_s} s: {await status(robot)}")


def says(sentence: str) -> Callable[[dict[str, Any]], bool]:
    return lambda answer: any(sentence in problem for problem in answer["problems"])


async def print_frames(robot: RealRobot, count: int, start: int = 0, junk: bytes = b"") -> None:
    """Good frames of both devices at 100 Hz, with junk before each."""
    for k in range(start, start + count):
        t = k * 0.01
        robot.uwb.write(junk + robot.hardware.uwb.frame(t, [(7, 5.0)]))
        robot.wheels.write(junk + robot.hardware.base.stream(t, 0.003 * k, 0.003 * k))
        await asyncio.sleep(0.01)


@pytest.mark.row("D1")
def test_garbage_between_frames_costs_no_frame() -> None:
    async def test(team: RealTeam, robot: RealRobot) -> None:
        junk = os.urandom(40)
        await print_frames(robot, 300, junk=junk)
        size = 300 * (len(junk) + len(robot.hardware.uwb.frame(0.0, [(7, 5.0)])))
        # ports are read in rounds
        await until(robot, lambda a: a["uwb"]["counters"]["bytes"] >= size, 2.0)
        answer = await status(robot)
        # two consistent frames come before the first that is believed
        assert answer["uwb"]["counters"]["frames.accepted"] >= 298
        assert answer["wheels"]["counters"]["messages.accepted"] >= 298
        assert answer["uwb"]["counters"]["garbage_bytes"] >= 300 * 40 - 40

    with_daemon(test)


def test_nothing_but_garbage_is_named_and_believed_never() -> None:
    async def test(team: RealTeam, robot: RealRobot) -> None:
        rng = np.random.default_rng(3)
        for _ in range(700):
            robot.uwb.write(rng.bytes(500))
            robot.wheels.write(rng.bytes(500))
            await asyncio.sleep(0.01)
        answer = await status(robot)
        assert says("is uwb.baud right")(answer)
        assert says("are wheels.source and wheels.baud right?")(answer)
        assert not answer["uwb"]["ranges"]

    with_daemon(test)


@pytest.mark.row("D7")
@pytest.mark.parametrize("baud", [115_200, 460_800, 2_000_000])
def test_the_wrong_baud_rate_is_asked_about(baud: int) -> None:
    async def test(team: RealTeam, robot: RealRobot) -> None:
        for k in range(600):
            frame = robot.hardware.uwb.frame(k * 0.01, [(7, 5.0), (8, 4.0)])
            robot.uwb.write(as_heard_at(frame, 921_600, baud))
            await asyncio.sleep(0.01)
        answer = await status(robot)
        assert says("is uwb.baud right")(answer)
        assert not answer["uwb"]["ranges"]

    with_daemon(test)


@pytest.mark.row("D5")
def test_a_cable_pulled_in_mid_frame_and_put_back_is_read_again() -> None:
    async def test(team: RealTeam, robot: RealRobot) -> None:
        for round_ in range(3):
            await print_frames(robot, 60, start=1000 * round_)
            half = robot.hardware.uwb.frame(10.0 * round_ + 0.7, [(7, 5.0)])
            robot.uwb.write(half[: len(half) // 2])
            await asyncio.sleep(0.05)
            before = (await status(robot))["uwb"]["counters"]["frames.accepted"]
            robot.uwb.pull()
            await until(robot, says("uwb: "), 2.0)
            robot.uwb.plug()
            await until(robot, lambda a: a["uwb"]["port"] == "open", 6.0)
            await print_frames(robot, 60, start=1000 * round_ + 500)
            await asyncio.sleep(2 * PERIOD_S)
            answer = await status(robot)
            assert answer["uwb"]["counters"]["frames.accepted"] >= before + 57

    with_daemon(test)


@pytest.mark.row("D5")
@pytest.mark.row("O8")
def test_descriptors_do_not_pile_up_when_a_cable_is_pulled_often() -> None:
    async def test(team: RealTeam, robot: RealRobot) -> None:
        assert robot.process is not None

        def descriptors() -> int:
            assert robot.process is not None
            return len(os.listdir(f"/proc/{robot.process.pid}/fd"))

        await until(robot, lambda a: a["uwb"]["port"] == "open", 5.0)
        before = descriptors()
        for _ in range(5):
            robot.uwb.pull()
            await until(robot, lambda a: a["uwb"]["port"] != "open", 3.0)
            robot.uwb.plug()
            await until(robot, lambda a: a["uwb"]["port"] == "open", 6.0)
        assert descriptors() <= before + 1

    with_daemon(test)


MALFORMED = {
    "nothing": b"",
    "one byte": b"\x4c",
    "a bare header": b"LC02\0\0\0\1",
    "a channel without its NUL": b"LC02\0\0\0\1" + b"DRSLAM_STATUS_001",
    "a channel of 200 letters": b"LC02\0\0\0\1" + b"A" * 200 + b"\0",
    "an empty channel": b"LC02\0\0\0\1\0payload",
    "a channel that is not ASCII": b"LC02\0\0\0\1\xff\xfe\0payload",
    "a fragment": b"LC03" + bytes(48),
    "a fragment whose offset wraps": b"LC03" + b"\xff" * 48,
    "another protocol": b"GET / HTTP/1.1\r\n\r\n",
    "the largest datagram": b"LC02\0\0\0\1" + b"\xaa" * 65_000,
    "a message of another program": b"LC02\0\0\0\1OTHER\0" + bytes(60),
    "an empty message on our channel": b"LC02\0\0\0\1DRSLAM_STATUS_001\0",
    "a type that is not ours": b"LC02\0\0\0\1DRSLAM_STATUS_001\0" + b"\x11" * 100,
}


@pytest.mark.row("N7")
def test_malformed_datagrams_of_every_kind_are_counted_and_nothing_else() -> None:
    async def test(team: RealTeam, robot: RealRobot) -> None:
        before = (await status(robot))["network"]["refused"]
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
            out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
            for datagram in MALFORMED.values():
                out.sendto(datagram, (GROUP, team.port))
            await asyncio.sleep(0.5)
            refused = (await status(robot))["network"]["refused"]
            assert sum(refused.values()) - sum(before.values()) == len(MALFORMED)
            for fault in lc02.FramingFault:
                assert refused.get(fault.value, 0) >= 1, fault

    with_daemon(test)


LAST_EPOCH = 2**63 - 1
LIES: dict[str, Message] = {
    "it heard a later start of this robot": a_status((Heard(0, LAST_EPOCH, 0),)),
    "it holds a log of a later start": a_status(logs=(LogState(0, LAST_EPOCH, 0, 0, 0),)),
    "it heard this one at the end of time": a_status((Heard(0, 2**62, 2**62, 2**31 - 1),)),
    "it has said all that can be said": an_entry(2**31 - 2, 1),
    "it is at the end of its odometry": OdometryBatch(0, 2**31 - 2, np.zeros((1, 3))),
}
"""What a member, or a stranger where there is no key, may say in one datagram."""


@pytest.mark.parametrize("epoch", [1, 2**53 + 2**32, LAST_EPOCH])
def test_no_member_can_end_it_by_what_it_says(epoch: int) -> None:
    async def test(team: RealTeam, robot: RealRobot) -> None:
        assert robot.process is not None
        before = await status(robot)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
            out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
            for liar, lie in enumerate(LIES.values(), start=3):
                told = forged(lie, robot=liar, epoch=epoch, counter=7, secret=team_key(None))
                out.sendto(lc02.encode(1, *told), (GROUP, team.port))
        await asyncio.sleep(4.0)
        after = await status(robot)
        assert after["epoch"] == before["epoch"]
        judged = sum(after["network"]["refused"].values()) + after["network"]["accepted"]
        assert judged == len(LIES)
        assert await robot.stop() == 0
        store = StateStore(robot.socket.parent, 0)
        assert store.load()["epoch"] == before["epoch"]
        assert store.fault == ""
        await robot.start()
        await robot.ready()
        assert (await status(robot))["epoch"] > before["epoch"]

    with_daemon(test)


@pytest.mark.row("N8")
def test_ten_thousand_junk_datagrams_a_second_keep_nobody_from_being_heard() -> None:
    """Neither its sensors nor a peer, which here has the same address as the junk."""

    async def test(team: RealTeam, robot: RealRobot) -> None:
        epoch = (await status(robot))["epoch"]
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
            out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
            junk = b"LC02\0\0\0\1DRSLAM_STATUS_001\0" + os.urandom(300)

            async def flood() -> None:
                for k in range(300):
                    for _ in range(100):
                        out.sendto(junk, (GROUP, team.port))
                    if k % 3 == 0:
                        said = a_status((Heard(0, epoch, 0),))
                        true = forged(said, robot=7, counter=k + 1, secret=team_key(None))
                        out.sendto(lc02.encode(k, *true), (GROUP, team.port))
                    await asyncio.sleep(0.01)

            await asyncio.gather(flood(), print_frames(robot, 300))
        await asyncio.sleep(0.3)
        answer = await status(robot)
        assert answer["uwb"]["counters"]["frames.accepted"] >= 298
        assert answer["peers"]["7"]["received"] >= 95
        refused, flooded = sum(answer["network"]["refused"].values()), answer["network"]["flooded"]
        assert refused < 10_000
        assert flooded > 10_000
        assert says("127.0.0.1 floods ")(answer)

    with_daemon(test)


def test_it_ends_within_two_seconds_of_being_asked_to_and_keeps_its_state() -> None:
    async def run() -> None:
        async with daemon() as (_, robot):
            await print_frames(robot, 50)
            began = asyncio.get_running_loop().time()
            assert await robot.stop() == 0
            assert asyncio.get_running_loop().time() - began < 2.0
            assert (robot.socket.parent / "robot-0.json").exists()

    asyncio.run(run())
