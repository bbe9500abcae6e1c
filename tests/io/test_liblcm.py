"""The transport of the lcm package; and the lcm package as the judge of our own framing."""

from __future__ import annotations

import asyncio
import builtins
import importlib.util
from pathlib import Path
from typing import Any

import pytest
from namespace import run_in_namespace
from transport_helpers import Ear, in_a_loop, running, until

from drslamd.config import ConfigError, GossipSection
from drslamd.events import ChannelMessage
from drslamd.io.clock import MonotonicClock
from drslamd.io.liblcm import Liblcm, default_url, require_lcm


def lcm_is_missing() -> str:
    """Why the lcm package cannot be used here; empty when it can."""
    if importlib.util.find_spec("lcm") is None:
        return "no package lcm"
    try:
        require_lcm()
    except ConfigError as error:
        return str(error)
    return ""


needs_lcm = pytest.mark.skipif(bool(lcm_is_missing()), reason=lcm_is_missing())


def a_transport(url: str) -> tuple[Liblcm, Ear]:
    ear = Ear()
    section = GossipSection(provider="liblcm", url=url)
    return Liblcm(section, MonotonicClock(), ear.events.append), ear


# what must be installed


def import_fails(monkeypatch: pytest.MonkeyPatch, error: ImportError) -> None:
    """From now on `import lcm` ends like this."""
    true_import = builtins.__import__

    def fake(name: str, *arguments: Any, **keywords: Any) -> Any:
        if name == "lcm":
            raise error
        return true_import(name, *arguments, **keywords)

    monkeypatch.setattr(builtins, "__import__", fake)


def test_without_glib_the_debian_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    missing = "libglib-2.0.so.0: cannot open shared object file: No such file or directory"
    import_fails(monkeypatch, ImportError(missing))
    with pytest.raises(ConfigError) as caught:
        require_lcm()
    assert caught.value.faults == [
        f'gossip.provider = "liblcm": {missing}; apt install libglib2.0-0'
    ]


def test_without_the_package_it_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    import_fails(monkeypatch, ModuleNotFoundError("No module named 'lcm'"))
    with pytest.raises(ConfigError) as caught:
        require_lcm()
    assert caught.value.faults == [
        "gossip.provider = \"liblcm\": No module named 'lcm'; pip install lcm"
    ]


# the URL


def test_the_url_means_the_group_of_the_native_transport() -> None:
    section = GossipSection(provider="liblcm", group="239.1.2.3", port=7000, ttl=0)
    assert default_url(section) == "udpm://239.1.2.3:7000?ttl=0"


def test_a_url_of_its_own_is_taken_as_it_is() -> None:
    assert default_url(GossipSection(provider="liblcm", url="tcpq://")) == "tcpq://"


# without a network


def test_what_is_sent_before_the_start_is_dropped_and_counted() -> None:
    transport, ear = a_transport("memq://")
    transport.send("DRSLAM_POSE_001", b"x")
    assert transport.dropped == 1
    assert ear.events == []


@needs_lcm
@in_a_loop
async def test_messages_go_through_a_provider_that_the_user_names() -> None:
    transport, ear = a_transport("memq://")
    async with running(transport):
        await until(ear.is_up)
        before = MonotonicClock().now()
        transport.send("DRSLAM_POSE_001", b"x")
        await until(lambda: bool(ear.messages))
    assert transport._lcm is None
    message = ear.events[-1]
    assert isinstance(message, ChannelMessage)
    assert (message.channel, message.payload, message.sender) == ("DRSLAM_POSE_001", b"x", "")
    assert before <= message.utime <= MonotonicClock().now()
    (state,) = ear.states
    assert (state.up, state.detail) == (True, "memq://")


@needs_lcm
@in_a_loop
async def test_a_url_that_lcm_does_not_take_is_told_in_one_sentence() -> None:
    transport, ear = a_transport("nonsense://")
    async with running(transport):
        await until(ear.is_down)
        await asyncio.sleep(0.7)
    (state,) = ear.states
    assert state.detail.startswith("nonsense://: ")


@needs_lcm
@in_a_loop
async def test_the_end_of_a_log_that_is_played_is_told_and_nothing_breaks(tmp_path: Path) -> None:
    import lcm

    log = lcm.EventLog(str(tmp_path / "team.lcmlog"), "w")
    for number in range(3):
        log.write_event(1_000 * number, "DRSLAM_POSE_001", b"%d" % number)
    log.close()
    transport, ear = a_transport(f"file://{tmp_path}/team.lcmlog?speed=0")
    async with running(transport):
        await until(ear.is_down)
    assert ear.messages[:3] == [("DRSLAM_POSE_001", b"%d" % number) for number in range(3)]
    assert ear.states[0].up
    assert ear.states[1].detail.startswith("cannot receive from file://")


# on a network, where only a namespace has the route that liblcm wants


@needs_lcm
@pytest.mark.slow
@pytest.mark.parametrize(
    "scenario",
    [
        "liblcm_decodes_what_we_encode",
        "we_decode_what_liblcm_puts_on_the_wire",
        "native_and_liblcm_hear_each_other_and_themselves",
        "a_burst_that_liblcm_would_drop_by_default_comes_through",
        "channels_of_other_programs_do_not_come_in_through_liblcm",
        "liblcm_without_a_route_says_so_once_and_joins_when_there_is_one",
    ],
)
def test_in_a_namespace(scenario: str) -> None:
    run_in_namespace(scenario)


@needs_lcm
@pytest.mark.slow
def test_lcm_logger_records_what_we_say(tmp_path: Path) -> None:
    run_in_namespace("lcm_logger_records_what_we_say", str(tmp_path))
