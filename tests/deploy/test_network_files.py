"""The snippets for systemd-networkd. (A real networkd reads them in test_systemd_box.)"""

from __future__ import annotations

import configparser
import ipaddress

from deploy_helpers import EXAMPLE, REPOSITORY

from drslamd.config import parse

NETWORK = REPOSITORY / "etc" / "network"


def sections(name: str) -> dict[str, dict[str, str]]:
    parser = configparser.ConfigParser(interpolation=None)
    parser.optionxform = str  # type: ignore[assignment, method-assign]
    parser.read_string((NETWORK / name).read_text())
    return {section: dict(parser[section]) for section in parser.sections()}


def test_can_comes_up_at_500_kbit_and_leaves_bus_off_by_itself() -> None:
    assert sections("80-can0.network") == {
        "Match": {"Name": "can0"},
        "Link": {"RequiredForOnline": "no"},
        "CAN": {"BitRate": "500K", "RestartSec": "100ms"},
    }


def test_the_route_holds_every_multicast_group() -> None:
    route = sections("multicast-route.conf")["Route"]
    group = ipaddress.ip_address(parse(EXAMPLE.read_text()).gossip.group)
    assert group in ipaddress.ip_network(route["Destination"])
    assert ipaddress.ip_network(route["Destination"]) == ipaddress.ip_network("224.0.0.0/4")
    assert route["Scope"] == "link"


def test_every_file_to_install_is_in_the_read_me() -> None:
    text = (EXAMPLE.parent / "README.md").read_text()
    files = [path for path in EXAMPLE.parent.rglob("*") if path.is_file()]
    for path in files:
        if path.name != "README.md":
            assert f"`{path.relative_to(EXAMPLE.parent)}`" in text
