"""What a client of Foxglove's protocol sees of ``drslamd feed foxglove``."""

from __future__ import annotations

import asyncio
import json
import subprocess
from pathlib import Path
from typing import Any

import pytest
from near_scenes import NEAR

from drslamd.feed.foxglove_server import as_json

aiohttp = pytest.importorskip("aiohttp", reason="aiohttp is not installed")
pytest.importorskip("foxglove", reason="foxglove-sdk is not installed")

import browser  # noqa: E402
from telling import feeding  # noqa: E402

TOPICS = {"/tf", "/robot_3/pose", "/robot_3/near"}
MESSAGE, HEAD = 1, 13
"""Of a binary message of that protocol: its kind, and the bytes before the content."""


def test_peers_are_shown_in_metres_and_seconds_with_their_sigmas() -> None:
    told = as_json(NEAR)
    assert told["peers"]["1"]["age_s"] == pytest.approx(0.1)
    assert told["peers"]["2"]["state"] == "stale"
    assert told["sigma"]["x_m"] == 0.25


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


def address(feed: subprocess.Popen[str]) -> str:
    """Where it says that it serves."""
    assert feed.stdout is not None
    return feed.stdout.readline().split()[1]


def test_a_client_sees_the_channels_and_what_is_told(tmp_path: Path) -> None:
    with feeding(tmp_path, "foxglove", "--port", "0") as feed:
        channels, told = asyncio.run(asyncio.wait_for(seen(address(feed)), 20))
    assert set(channels) == TOPICS
    assert channels["/tf"]["schemaName"] == "foxglove.FrameTransforms"
    assert told == as_json(NEAR)


BROWSED = """new Promise((resolve, reject) => {
  const socket = new WebSocket(%s, ["foxglove.sdk.v1"]), topics = new Map(), told = {};
  socket.binaryType = "arraybuffer";
  socket.onerror = () => reject(new Error("no connection"));
  socket.onmessage = ({ data }) => {
    if (typeof data === "string") {
      const said = JSON.parse(data), subscriptions = [];
      for (const { id, topic } of said.op === "advertise" ? said.channels : []) {
        topics.set(id, topic);
        subscriptions.push({ id, channelId: id });
      }
      socket.send(JSON.stringify({ op: "subscribe", subscriptions }));
    } else if (new Uint8Array(data)[0] === 1) {
      const topic = topics.get(new DataView(data).getUint32(1, true));
      told[topic] = new TextDecoder().decode(new Uint8Array(data, 13));
      if (Object.keys(told).length === 3) { socket.close(); resolve(told); }
    }
  };
})"""
"""A client in a browser: what comes first on each channel, as text."""


async def browsed(url: str) -> dict[str, str]:
    async with browser.tab() as page:
        told: dict[str, str] = await page.run(BROWSED % json.dumps(url))
        assert page.complaints == []
        return told


@pytest.mark.slow
@pytest.mark.skipif(browser.CHROMIUM is None, reason="no chromium is installed")
def test_a_browser_sees_frames_pose_and_peers(tmp_path: Path) -> None:
    with feeding(tmp_path, "foxglove", "--port", "0") as feed:
        told = asyncio.run(browsed(address(feed)))
    assert set(told) == TOPICS
    assert json.loads(told["/robot_3/near"]) == as_json(NEAR)
    for frame in ("team_of_0", "robot_3/odom", "robot_3/base_link", "robot_3/sees/robot_2"):
        assert frame in told["/tf"]
    assert "team_of_0" in told["/robot_3/pose"]
