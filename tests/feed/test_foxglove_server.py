"""What a client of Foxglove's protocol sees."""

from __future__ import annotations

import asyncio
import json

import pytest
from near_scenes import NEAR

pytest.importorskip("foxglove", reason="foxglove-sdk is not installed")
aiohttp = pytest.importorskip("aiohttp", reason="aiohttp is not installed")

from drslamd.feed.foxglove_server import FoxgloveServer, as_json  # noqa: E402


def test_a_client_sees_the_channels_and_what_is_told() -> None:
    server = FoxgloveServer(3, "127.0.0.1", 0)

    async def look() -> tuple[dict, dict]:
        url = f"ws://127.0.0.1:{server.port}"
        async with (
            aiohttp.ClientSession() as session,
            session.ws_connect(url, protocols=["foxglove.sdk.v1"]) as socket,
        ):
            channels: dict = {}
            while len(channels) < 3:
                message = await socket.receive(10)
                if message.type == aiohttp.WSMsgType.TEXT:
                    said = json.loads(message.data)
                    if said["op"] == "advertise":
                        channels |= {each["topic"]: each for each in said["channels"]}
            channel = channels["/robot_3/near"]["id"]
            wanted = [{"id": 1, "channelId": channel}]
            await socket.send_str(json.dumps({"op": "subscribe", "subscriptions": wanted}))
            while True:
                server.tell(NEAR)
                try:
                    message = await socket.receive(0.2)
                except asyncio.TimeoutError:
                    continue
                if message.type == aiohttp.WSMsgType.BINARY and message.data[0] == 1:
                    return channels, json.loads(message.data[13:])

    try:
        channels, told = asyncio.run(asyncio.wait_for(look(), 20))
    finally:
        server.close()
    assert set(channels) == {"/tf", "/robot_3/pose", "/robot_3/near"}
    assert channels["/tf"]["schemaName"] == "foxglove.FrameTransforms"
    assert told == as_json(NEAR)
    assert told["peers"]["1"]["age_s"] == pytest.approx(0.1)
    assert told["sigma"]["x_m"] == 0.25
