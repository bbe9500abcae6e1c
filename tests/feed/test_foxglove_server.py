"""What a client of Foxglove's protocol sees of ``drslamd feed foxglove``."""

from __future__ import annotations

import asyncio
import importlib.util
import json
import socket
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest
from near_scenes import NEAR
from places import REPOSITORY

from drslamd.feed.foxglove_server import as_json
from drslamd.gossip.seal import VERSION, Header
from drslamd.near.near_message import encode

aiohttp = pytest.importorskip("aiohttp", reason="aiohttp is not installed")

CONFIG = """
[robot]
id = 3
[team]
insecure = true
[uwb]
port = "/dev/none"
[wheels]
source = "kobuki"
port = "/dev/none"
[daemon]
status_socket = "{folder}/3.sock"
"""
MESSAGE, HEAD = 1, 13
"""Of a binary message of that protocol: its kind, and the bytes before the content."""


def test_peers_are_shown_in_metres_and_seconds_with_their_sigmas() -> None:
    told = as_json(NEAR)
    assert told["peers"]["1"]["age_s"] == pytest.approx(0.1)
    assert told["peers"]["2"]["state"] == "stale"
    assert told["sigma"]["x_m"] == 0.25


def telling(path: Path, ended: threading.Event) -> threading.Thread:
    """A daemon that says the same again and again."""
    daemon = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    daemon.bind(str(path))
    daemon.listen(1)

    def serve() -> None:
        with daemon, daemon.accept()[0] as reader:
            while not ended.wait(0.05):
                reader.send(encode(Header(VERSION, 3, 7, 0, 5_000_001), NEAR))

    thread = threading.Thread(target=serve)
    thread.start()
    return thread


async def seen(url: str) -> tuple[dict[str, Any], Any]:
    """Channels by topic, and what the third of them says."""
    async with (
        aiohttp.ClientSession() as session,
        session.ws_connect(url, protocols=["foxglove.sdk.v1"]) as client,
    ):
        channels: dict[str, Any] = {}
        while len(channels) < 3:
            message = await client.receive(10)
            if message.type == aiohttp.WSMsgType.TEXT:
                said = json.loads(message.data)
                new = said["channels"] if said["op"] == "advertise" else []
                channels |= {each["topic"]: each for each in new}
        wanted = {"id": 1, "channelId": channels["/robot_3/near"]["id"]}
        await client.send_str(json.dumps({"op": "subscribe", "subscriptions": [wanted]}))
        while True:
            message = await client.receive(10)
            if message.type == aiohttp.WSMsgType.BINARY and message.data[0] == MESSAGE:
                return channels, json.loads(message.data[HEAD:])


@pytest.mark.skipif(
    importlib.util.find_spec("foxglove") is None, reason="foxglove-sdk is not installed"
)
def test_a_client_sees_the_channels_and_what_is_told(tmp_path: Path) -> None:
    config, ended = tmp_path / "3.toml", threading.Event()
    config.write_text(CONFIG.format(folder=tmp_path))
    daemon = telling(tmp_path / "3.near", ended)
    command = (sys.executable, "-m", "drslamd", "feed", "foxglove", "-c", str(config))
    with subprocess.Popen(
        (*command, "--port", "0"), cwd=REPOSITORY, stdout=subprocess.PIPE, text=True
    ) as feed:
        assert feed.stdout is not None
        url = feed.stdout.readline().split()[1]
        try:
            channels, told = asyncio.run(asyncio.wait_for(seen(url), 20))
        finally:
            feed.terminate()
            ended.set()
            daemon.join()
    assert set(channels) == {"/tf", "/robot_3/pose", "/robot_3/near"}
    assert channels["/tf"]["schemaName"] == "foxglove.FrameTransforms"
    assert told == as_json(NEAR)
