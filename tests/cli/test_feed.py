"""``drslamd feed``: what it says when it cannot, and what others hear when it can."""

from __future__ import annotations

import argparse
import signal
import socket
import sys
from pathlib import Path
from typing import NoReturn

import pytest
from lab.play.real_team import free_port
from near_scenes import NEAR
from telling import feeding

from drslamd import cli
from drslamd.cli import feed


def test_without_a_daemon_it_says_so(config: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("pymavlink", reason="pymavlink is not installed")
    assert cli.main(["feed", "mavlink", "-c", str(config)]) == 69
    said = capsys.readouterr().err
    assert said.startswith("no daemon answers at ")
    assert said.endswith(f"; start it: drslamd run -c {config}\n")


@pytest.mark.parametrize(
    ("kind", "module"),
    [("mavlink", "pymavlink"), ("foxglove", "foxglove"), ("dimos", "dimos_lcm")],
)
def test_without_its_package_it_names_it(
    config: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    kind: str,
    module: str,
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    for name in [name for name in sys.modules if name.startswith(f"{module}.")]:
        monkeypatch.setitem(sys.modules, name, None)
    assert cli.main(["feed", kind, "-c", str(config)]) == 69
    assert f'pip install "drslamd[{kind}]"' in capsys.readouterr().err


@pytest.mark.parametrize("to", ["nowhere", ":14550", "host:0", "host:65536", "host:x"])
def test_a_place_that_is_none_is_wrong_usage(
    config: Path, capsys: pytest.CaptureFixture[str], to: str
) -> None:
    assert cli.main(["feed", "mavlink", "-c", str(config), "--to", to]) == 64
    assert f"--to {to}: must be HOST:PORT" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("flags", "sentence"),
    [
        (("--port", "65536"), "--port 65536: 0 to 65535"),
        (("--port", "-1"), "--port -1: 0 to 65535"),
        (("--domain", "233"), "--domain 233: 0 to 232"),
        (("--domain", "-1"), "--domain -1: 0 to 232"),
    ],
)
def test_a_number_that_is_none_is_wrong_usage(
    config: Path, capsys: pytest.CaptureFixture[str], flags: tuple[str, str], sentence: str
) -> None:
    assert cli.main(["feed", "ros2", "-c", str(config), *flags]) == 64
    assert capsys.readouterr().err == f"drslamd feed: {sentence}\n"


@pytest.mark.parametrize(
    ("kind", "flag"),
    [("mavlink", "--to"), ("foxglove", "--port"), ("ros2", "--domain"), ("dimos", "--url")],
)
@pytest.mark.parametrize("error", [OSError(98, "in use"), RuntimeError("in use")])
def test_a_place_where_nothing_can_be_told_says_which_flag_names_another(
    config: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    kind: str,
    flag: str,
    error: Exception,
) -> None:
    def refuse(_: argparse.Namespace) -> NoReturn:
        raise error

    monkeypatch.setattr(feed, "_made", lambda *_: refuse)
    assert cli.main(["feed", kind, "-c", str(config)]) == 69
    cause, _, remedy = capsys.readouterr().err.partition("; ")
    assert cause == f"drslamd feed {kind}: in use"
    assert flag in remedy


def test_a_file_that_cannot_be_made_is_one_sentence(
    config: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    pytest.importorskip("mcap", reason="mcap is not installed")
    there = str(tmp_path / "no" / "run.mcap")
    assert cli.main(["feed", "ros2", "-c", str(config), "--mcap", there]) == 73
    assert f"No such file or directory; make its folder first: mkdir -p {tmp_path}/no" in (
        capsys.readouterr().err
    )


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_file_has_its_end_however_the_feed_is_ended(tmp_path: Path, number: int) -> None:
    pytest.importorskip("mcap", reason="mcap is not installed")
    from mcap.reader import make_reader

    path = tmp_path / "run.mcap"
    with feeding(tmp_path, "ros2", "--mcap", str(path)) as feed:
        feed.send_signal(number)
        assert feed.wait(10) == 0
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count > 0


@pytest.mark.slow
def test_an_autopilot_hears_the_feed_at_its_port(tmp_path: Path) -> None:
    common = pytest.importorskip("pymavlink.dialects.v20.common", reason="no pymavlink")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
        port.bind(("127.0.0.1", 0))
        port.settimeout(20)
        to = f"127.0.0.1:{port.getsockname()[1]}"
        with feeding(tmp_path, "mavlink", "--to", to):
            (message,) = common.MAVLink(None).parse_buffer(port.recv(1024))
    assert message.get_type() == "ODOMETRY"
    assert (message.x, message.y) == pytest.approx((NEAR.pose[0], -NEAR.pose[1]))


@pytest.mark.slow
def test_dimos_hears_the_feed_over_lcm(tmp_path: Path) -> None:
    nav = pytest.importorskip("dimos_lcm.nav_msgs", reason="dimos-lcm is not installed")
    import lcm

    url = f"udpm://239.255.76.67:{free_port()}?ttl=0"
    try:
        bus = lcm.LCM(url)
    except RuntimeError:
        pytest.skip("LCM finds no network for multicast here")
    heard: list[bytes] = []
    bus.subscribe("/robot_3/odometry#nav_msgs.Odometry", lambda _, payload: heard.append(payload))
    with feeding(tmp_path, "dimos", "--url", url):
        for _ in range(40):
            if not heard:
                bus.handle_timeout(500)
    message = nav.Odometry.lcm_decode(heard[0])
    assert message.child_frame_id == "robot_3/base_link"
    assert message.pose.pose.position.y == NEAR.odom[1]
