"""Who may ask the live map for what. The map is read-only, and no door to anything behind it.

Only GET, only the paths of the page, only under a name that the map goes by: a page of somebody
else whose name was made to point here (DNS rebinding) still says its own name. Addresses cannot be
bent that way. Files are read once, when the map starts; a path is looked up, never opened.
"""

from __future__ import annotations

import ipaddress
import socket
from collections.abc import Mapping, Sequence
from enum import Enum
from importlib import resources
from typing import NamedTuple

STREAM = "/stream"
"""The one path that is no file."""
TYPES = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
}
LOCAL = "localhost"

HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; "
    "img-src 'self'; connect-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
    "Server": "drslamd",
}
"""Of every answer: nothing from elsewhere, nothing to elsewhere, in nobody's frame."""


class TurnedAway(Enum):
    """Why somebody is turned away: the code of HTTP and what is said."""

    METHOD = 405, "the map can only be looked at: GET"
    HOST = 421, "the map does not go by this name; ask for it by its address"
    ELSEWHERE = 403, "a page from elsewhere asks for the map"
    PATH = 404, "there is nothing here"
    FULL = 503, "too many look at the map already; close a page"


class File(NamedTuple):
    """One file of the page."""

    kind: str
    content: bytes


class Door:
    """Judges requests."""

    def __init__(self, listen: str, port: int, files: Mapping[str, File]) -> None:
        """
        Args:
            listen: the address that is listened on; port: likewise.
        """
        self._files, self._port = files, port
        self._is_open = not is_loopback(listen)
        self._names = {LOCAL}
        if self._is_open:
            own = socket.gethostname().lower()
            self._names |= {own, f"{own}.local"}

    def judge(
        self, method: str, hosts: Sequence[str], site: str, path: str
    ) -> TurnedAway | File | None:
        """A file, or None for the stream of updates, or why neither.

        Args:
            hosts: all Host headers; site: what the browser says of the page that asks.
        """
        if method != "GET":
            return TurnedAway.METHOD
        if len(hosts) != 1 or not self._goes_by(hosts[0].lower()):
            return TurnedAway.HOST
        if site not in ("", "none", "same-origin") and path != "/":
            return TurnedAway.ELSEWHERE
        if path == STREAM:
            return None
        return self._files.get(path, TurnedAway.PATH)

    def _goes_by(self, host: str) -> bool:
        name, _, port = host.rpartition(":")
        if not port.isdigit() or host.endswith("]"):
            name, port = host, "80"
        if port != str(self._port):
            return False
        try:
            address = ipaddress.ip_address(name.strip("[]"))
        except ValueError:
            return name in self._names
        return self._is_open or address.is_loopback


def is_loopback(listen: str) -> bool:
    """Is it an address that only this computer reaches?"""
    try:
        return ipaddress.ip_address(listen).is_loopback
    except ValueError:
        return listen == LOCAL


def files() -> dict[str, File]:
    """The files of the page, by path; "/" is the page itself."""
    out = {}
    for entry in resources.files("drslamd.view").joinpath("static").iterdir():
        kind = TYPES.get("." + entry.name.rpartition(".")[2])
        if kind is not None:
            out[f"/{entry.name}"] = File(kind, entry.read_bytes())
    out["/"] = out["/index.html"]
    return out
