"""Who may ask the map for what."""

from __future__ import annotations

import re
import socket

import pytest
from places import REPOSITORY

from drslamd.view.door import HEADERS, STREAM, Door, File, TurnedAway, files, is_loopback

PAGE = File("text/html; charset=utf-8", b"page")
FILES = {"/": PAGE, "/app.js": File("text/javascript; charset=utf-8", b"script")}
STATIC = REPOSITORY / "drslamd" / "view" / "static"


def ask(
    *,
    listen: str = "127.0.0.1",
    port: int = 8808,
    method: str = "GET",
    hosts: tuple[str, ...] = ("127.0.0.1:8808",),
    site: str = "",
    path: str = "/",
) -> TurnedAway | File | None:
    return Door(listen, port, FILES).judge(method, hosts, site, path)


def test_the_page_its_files_and_the_stream_are_handed_out() -> None:
    assert ask() is PAGE
    assert ask(path="/app.js") is FILES["/app.js"]
    assert ask(path=STREAM) is None


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "HEAD", "OPTIONS", "CONNECT", "get"])
def test_the_map_can_only_be_looked_at(method: str) -> None:
    assert ask(method=method) is TurnedAway.METHOD
    assert ask(method=method, path=STREAM) is TurnedAway.METHOD


@pytest.mark.parametrize(
    "path",
    [
        "/../door.py",
        "/static/app.js",
        "/app.js/",
        "//app.js",
        "/APP.JS",
        "/app.js\0",
        "",
        "/etc/passwd",
    ],
)
def test_every_other_path_is_refused(path: str) -> None:
    assert ask(path=path) is TurnedAway.PATH


@pytest.mark.parametrize(
    ("host", "is_ours"),
    [
        ("127.0.0.1:8808", True),
        ("localhost:8808", True),
        ("LOCALHOST:8808", True),
        ("[::1]:8808", True),
        ("127.0.0.1:8809", False),
        ("127.0.0.1", False),
        ("[::1]", False),
        ("", False),
        ("evil.example:8808", False),
        ("localhost.evil.example:8808", False),
        ("127.0.0.1.evil.example:8808", False),
        ("192.168.1.7:8808", False),
        (f"{socket.gethostname()}.local:8808", False),
    ],
)
def test_on_loopback_it_goes_by_names_of_this_computer_only(host: str, is_ours: bool) -> None:
    assert ask(hosts=(host,)) is (PAGE if is_ours else TurnedAway.HOST)


@pytest.mark.parametrize(
    ("host", "is_ours"),
    [
        ("192.168.1.7:8808", True),
        ("localhost:8808", True),
        (f"{socket.gethostname()}.local:8808", True),
        ("evil.example:8808", False),
        ("192.168.1.7:80", False),
    ],
)
def test_beyond_loopback_it_goes_by_any_address_and_its_own_name(host: str, is_ours: bool) -> None:
    assert ask(listen="0.0.0.0", hosts=(host,)) is (PAGE if is_ours else TurnedAway.HOST)


def test_a_browser_leaves_out_port_80() -> None:
    assert ask(port=80, hosts=("127.0.0.1",)) is PAGE
    assert ask(port=80, hosts=("[::1]",)) is PAGE


@pytest.mark.parametrize("hosts", [(), ("127.0.0.1:8808", "127.0.0.1:8808")])
def test_one_host_is_named_and_not_none_or_two(hosts: tuple[str, ...]) -> None:
    assert ask(hosts=hosts) is TurnedAway.HOST


@pytest.mark.parametrize(
    ("site", "path", "is_refused"),
    [
        ("same-origin", STREAM, False),
        ("none", "/", False),
        ("cross-site", "/", False),
        ("cross-site", STREAM, True),
        ("same-site", "/", False),
        ("same-site", STREAM, True),
        ("cross-site", "/app.js", True),
    ],
)
def test_a_page_from_elsewhere_may_lead_here_but_not_take_anything(
    site: str, path: str, is_refused: bool
) -> None:
    assert (ask(site=site, path=path) is TurnedAway.ELSEWHERE) is is_refused


@pytest.mark.parametrize(
    ("listen", "is_local"),
    [("127.0.0.1", True), ("127.3.2.1", True), ("::1", True), ("0.0.0.0", False), ("::", False)],
)
def test_what_only_this_computer_reaches(listen: str, is_local: bool) -> None:
    assert is_loopback(listen) is is_local


def test_the_files_are_those_of_the_folder_and_nothing_else() -> None:
    found = files()
    assert set(found) == {"/", *(f"/{path.name}" for path in STATIC.iterdir())}
    assert found["/"].content == (STATIC / "index.html").read_bytes()
    assert found["/app.js"].kind == "text/javascript; charset=utf-8"


def test_the_page_takes_nothing_from_elsewhere_and_runs_nothing_inline() -> None:
    for path in STATIC.iterdir():
        text = path.read_text().replace("http://www.w3.org/2000/svg", "")
        assert not re.search(r"https?://|//cdn|@import|\beval\(|innerHTML", text), path.name
    html = (STATIC / "index.html").read_text()
    assert not re.search(r"<script(?![^>]*src=)|<style|\son\w+=|\sstyle=", html)
    assert "default-src 'none'" in HEADERS["Content-Security-Policy"]
    assert "unsafe" not in HEADERS["Content-Security-Policy"]


def test_all_that_a_page_asks_for_is_there() -> None:
    found, asked = files(), set()
    for path in STATIC.glob("*.js"):
        asked |= set(re.findall(r'from "\./([\w.]+)"', path.read_text()))
    asked |= set(re.findall(r'(?:src|href)="([\w.]+)"', (STATIC / "index.html").read_text()))
    assert len(asked) >= 8
    assert {f"/{name}" for name in asked} <= set(found)
