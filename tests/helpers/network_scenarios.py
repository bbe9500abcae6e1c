"""What can only be tried where interfaces may come and go; `namespace` runs these as a program."""

from __future__ import annotations

import asyncio
import socket
import subprocess
import sys
from pathlib import Path

from acquainted import introduce
from transport_helpers import GROUP, Ear, native, running, section, spoken_until, until

from drslamd.config import GossipSection
from drslamd.conventions import Chain
from drslamd.events import ChannelMessage
from drslamd.gossip import lc02, messages
from drslamd.gossip.message_types import Pose, PoseState
from drslamd.gossip.seal import Seal, team_key
from drslamd.gossip.team import Team
from drslamd.io.clock import MonotonicClock
from drslamd.io.liblcm import Liblcm
from drslamd.io.multicast import open_group

ADDRESS = "10.10.0.1"
OTHER_ADDRESS = "10.10.0.2"


def ip(command: str) -> None:
    subprocess.run(["ip", *command.split()], check=True)


def plug_in(name: str = "wlan0", address: str = ADDRESS) -> None:
    """An interface with an address and no default route, as an ad-hoc network has."""
    ip(f"link add {name} type veth peer name far-{name}")
    ip(f"link set far-{name} up")
    ip(f"link set {name} up")
    ip(f"addr add {address}/24 dev {name}")


def snooping_switch() -> None:
    """A switch that sends a group only where somebody said that it is wanted.

    The robot is on one of its ports, somebody else on another one, both on this computer.
    """
    conf = Path("/proc/sys/net/ipv4/conf/all")
    (conf / "accept_local").write_text("1")
    (conf / "rp_filter").write_text("0")
    ip("link add switch type bridge")
    # it believes its own memory as soon as answers to its one question would have come
    ip("link set switch type bridge mcast_query_response_interval 50 mcast_query_interval 100000")
    ip("link set switch type bridge mcast_querier 1")
    for name, address in (("wlan0", ADDRESS), ("eth0", OTHER_ADDRESS)):
        plug_in(name, address)
        ip(f"link set far-{name} master switch")
    ip("link set switch up")


def forget_group() -> None:
    """As a switch does that hears nothing of it for minutes."""
    command = ["bridge", "mdb", "del", "dev", "switch", "port", "far-wlan0", "grp", GROUP]
    subprocess.run(command, check=True)


def on_the_other_port() -> socket.socket:
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(OTHER_ADDRESS))
    return sender


WORD = "DRSLAM_POSE_009"


async def a_switch_that_forgot_the_group_is_told_again() -> None:
    snooping_switch()
    where = section("wlan0").model_copy(update={"ttl": 1})
    transport, ear = native(where)

    async def heard_of(count: int) -> int:
        before = len(ear.messages)
        for number in range(count):
            sender.sendto(lc02.encode(number, WORD, b"x"), (GROUP, where.port))
        await asyncio.sleep(0.1)
        return sum(channel == WORD for channel, _ in ear.messages[before:])

    with on_the_other_port() as sender:
        async with running(transport):
            await spoken_until(transport, ear.is_up)
            await asyncio.sleep(4.0)
            assert await heard_of(20) == 20
            forget_group()
            assert await heard_of(20) == 0, "a switch that snoops does not forget"
            for _ in range(120):
                if await heard_of(1):
                    break
            else:
                raise AssertionError("nothing was heard again within twelve seconds")
    assert [state.up for state in ear.states] == [True]


async def without_any_route_the_user_is_told_to_name_an_interface() -> None:
    transport, ear = native(section(""))
    async with running(transport):
        await until(ear.is_down)
        await asyncio.sleep(1.0)
    (state,) = ear.states
    assert state.detail == (
        f"cannot join {GROUP} on the default interface: No such device; "
        "name one as gossip.interface"
    ), state.detail


async def an_interface_that_appears_later_is_joined() -> None:
    transport, ear = native(section("wlan0"))
    async with running(transport):
        await until(ear.is_down)
        await asyncio.sleep(1.0)
        assert len(ear.states) == 1
        plug_in()
        await spoken_until(transport, ear.is_up, 6.0)
    assert [state.up for state in ear.states] == [False, True]


async def an_ad_hoc_network_without_a_default_route_works_by_name() -> None:
    plug_in()
    where = section("wlan0")
    (a, heard_by_a), (b, heard_by_b) = native(where), native(where)
    async with running(a), running(b):
        await spoken_until(a, heard_by_a.is_up)
        await spoken_until(b, heard_by_b.is_up)
        a.send("DRSLAM_POSE_001", b"from a")
        await until(lambda: ("DRSLAM_POSE_001", b"from a") in heard_by_b.messages)


async def heard_again(interface: str) -> None:
    """Two robots behind one USB adapter that is pulled out and put back."""
    plug_in()
    where = section(interface)
    (a, heard_by_a), (b, heard_by_b) = native(where), native(where)
    async with running(a), running(b):
        for _ in range(2):
            await spoken_until(a, heard_by_a.is_up, 10.0)
            await spoken_until(b, heard_by_b.is_up, 10.0)
            ip("link del wlan0")
            await spoken_until(a, heard_by_a.is_down)
            await spoken_until(b, heard_by_b.is_down)
            await asyncio.sleep(1.0)
            plug_in()
            heard_by_b.events.clear()
            took = await spoken_until(a, lambda: bool(heard_by_b.messages), 10.0)
            print(f"heard again after {took:.1f} s")


async def an_interface_that_is_created_anew_is_heard_again_within_ten_seconds_by_name() -> None:
    await heard_again("wlan0")


async def an_interface_that_is_created_anew_is_heard_again_within_ten_seconds_by_address() -> None:
    await heard_again(ADDRESS)


async def an_interface_that_was_down_is_heard_again_and_spoken_of_once() -> None:
    plug_in()
    transport, ear = native(section("wlan0"))
    async with running(transport):
        await spoken_until(transport, ear.is_up)
        ear.events.clear()
        ip("link set wlan0 down")
        await spoken_until(transport, ear.is_down)
        for _ in range(60):
            transport.send("DRSLAM_STATUS_009", b"into the void")
            await asyncio.sleep(0.05)
        for state in ear.states:
            print(state)
        assert len(ear.states) <= 2, ear.states
        assert not any(state.up for state in ear.states)
        ip("link set wlan0 up")
        took = await spoken_until(transport, ear.is_up, 10.0)
        print(f"up again after {took:.1f} s")


async def the_group_on_an_interface_that_others_joined_is_not_heard() -> None:
    plug_in("wlan0", "10.10.0.1")
    plug_in("eth0", "10.20.0.1")
    where = section("wlan0")
    transport, ear = native(where)
    other, other_ear = native(where.model_copy(update={"interface": "eth0"}))
    async with running(transport), running(other):
        await spoken_until(transport, ear.is_up)
        await spoken_until(other, other_ear.is_up)
        ear.events.clear()
        other.send("DRSLAM_POSE_002", b"on eth0")
        await until(lambda: ("DRSLAM_POSE_002", b"on eth0") in other_ear.messages)
        transport.send("DRSLAM_POSE_001", b"on wlan0")
        await until(lambda: ("DRSLAM_POSE_001", b"on wlan0") in ear.messages)
        assert ear.messages == [("DRSLAM_POSE_001", b"on wlan0")]


# with the lcm package


def route_to_the_group() -> None:
    """What liblcm needs, and our own transport does not."""
    ip("link set lo up multicast on")
    ip("route add 224.0.0.0/4 dev lo")


def liblcm(where: GossipSection) -> tuple[Liblcm, Ear]:
    """The transport of the lcm package and what it hears."""
    ear = Ear()
    chosen = where.model_copy(update={"provider": "liblcm"})
    return Liblcm(chosen, MonotonicClock(), ear.events.append), ear


SAID = [
    ("DRSLAM_A", b""),
    ("DRSLAM_B", b"payload"),
    ("DRSLAM_C", bytes(range(256)) * 5),
    ("DRSLAM_D", bytes(1400)),
    ("DRSLAM_" + "E" * 56, bytes(1400)),
]
"""Channels of up to LCM's 63 characters, payloads of up to our 1400 bytes."""


async def liblcm_decodes_what_we_encode() -> None:
    import lcm

    route_to_the_group()
    where = section("lo")
    heard: list[tuple[str, bytes]] = []
    listener = lcm.LCM(f"udpm://{GROUP}:{where.port}?ttl=0")
    listener.subscribe(".*", lambda channel, data: heard.append((channel, data)))
    with open_group(where) as sender:
        for number, (channel, payload) in enumerate(SAID):
            sender.sendto(lc02.encode(number, channel, payload), (GROUP, where.port))
            assert listener.handle_timeout(2000) > 0
    assert heard == SAID


async def we_decode_what_liblcm_puts_on_the_wire() -> None:
    import lcm

    route_to_the_group()
    where = section("lo")
    publisher = lcm.LCM(f"udpm://{GROUP}:{where.port}?ttl=0")
    with open_group(where) as listener:
        for number, (channel, payload) in enumerate(SAID):
            publisher.publish(channel, payload)
            data = await asyncio.wait_for(asyncio.get_running_loop().sock_recv(listener, 65536), 2)
            assert lc02.decode(data) == (channel, payload)
            assert data == lc02.encode(number, channel, payload)
        publisher.publish("DRSLAM_BIG", bytes(1401))
        data = await asyncio.wait_for(asyncio.get_running_loop().sock_recv(listener, 65536), 2)
        assert lc02.decode(data) is lc02.FramingFault.TOO_LONG


async def native_and_liblcm_hear_each_other_and_themselves() -> None:
    route_to_the_group()
    where = section("lo")
    (ours, our_ear), (theirs, their_ear) = native(where), liblcm(where)
    async with running(ours), running(theirs):
        await until(their_ear.is_up, 15.0)
        await spoken_until(ours, our_ear.is_up)
        ours.send("DRSLAM_POSE_001", b"native")
        theirs.send("DRSLAM_POSE_002", b"liblcm")
        both = [("DRSLAM_POSE_001", b"native"), ("DRSLAM_POSE_002", b"liblcm")]
        await until(lambda: all(message in our_ear.messages for message in both))
        await until(lambda: all(message in their_ear.messages for message in both))
    assert (ours.dropped, theirs.dropped) == (0, 0)


async def a_burst_that_liblcm_would_drop_by_default_comes_through() -> None:
    route_to_the_group()
    where = section("lo")
    transport, ear = liblcm(where)
    burst = [("DRSLAM_POSE_001", b"%d" % number) for number in range(100)]
    async with running(transport):
        await until(ear.is_up, 15.0)
        for message in burst:
            transport.send(*message)
        await until(lambda: len(ear.messages) == len(burst))
    assert ear.messages == burst


async def channels_of_other_programs_do_not_come_in_through_liblcm() -> None:
    route_to_the_group()
    transport, ear = liblcm(section("lo"))
    async with running(transport):
        await until(ear.is_up, 15.0)
        transport.send("MBOT_ODOMETRY", b"theirs")
        transport.send("DRSLAM_POSE_001", b"ours")
        await until(lambda: bool(ear.messages))
        await asyncio.sleep(0.1)
    assert ear.messages == [("DRSLAM_POSE_001", b"ours")]


async def liblcm_without_a_route_says_so_once_and_joins_when_there_is_one() -> None:
    ip("link set lo up multicast on")
    transport, ear = liblcm(section("lo"))
    async with running(transport):
        await until(ear.is_down)
        await asyncio.sleep(1.0)
        (state,) = ear.states
        assert "udpm://" in state.detail
        ip("route add 224.0.0.0/4 dev lo")
        await until(ear.is_up, 10.0)


async def lcm_logger_records_what_we_say(folder: str) -> None:
    import lcm

    route_to_the_group()
    where, log = section("lo"), Path(folder) / "team.lcmlog"
    speaker, listener = (Team(Seal(team_key(None), robot, 1, {})) for robot in (3, 4))
    poses = [Pose(PoseState.LOCALISED, 3, 1, number, (1.0, 2.0, 3.0)) for number in range(20)]
    transport, ear = native(where)
    # the program itself, which the console script of the same name would only start
    logger = await asyncio.create_subprocess_exec(
        Path(lcm.LCM_BIN_DIR) / "lcm-logger",
        "--quiet",
        "--flush-interval=50",
        f"--lcm-url=udpm://{GROUP}:{where.port}?ttl=0",
        log,
    )
    try:
        async with running(transport):
            await spoken_until(transport, ear.is_up)
            await spoken_until(transport, lambda: log.exists() and log.stat().st_size > 0, 10.0)
            for pose in poses:
                send = speaker.send(pose, 0)
                transport.send(send.channel, send.payload)
            # it writes what it has when the next message comes
            await spoken_until(
                transport, lambda: log.read_bytes().count(b"DRSLAM_POSE_003") == len(poses)
            )
    finally:
        logger.terminate()
        await logger.wait()
    said = []
    events = lcm.EventLog(str(log))
    introduce(listener, Chain(3, 1))
    for event in events:
        if event.channel == "DRSLAM_POSE_003":
            said.append(messages.decode("POSE", event.data))
            message = ChannelMessage(0, event.channel, event.data)
            assert listener.receive(message) is not None
    events.close()
    assert said == poses


if __name__ == "__main__":
    asyncio.run(globals()[sys.argv[1]](*sys.argv[2:]))
