"""Versions of IGMP, from a file like the kernel's."""

from __future__ import annotations

from pathlib import Path

import pytest
from host_trees import HostTree
from patients import configuration

from drslamd.doctor.machine.igmp import igmp

LISTED = """Idx\tDevice    : Count Querier\tGroup    Users Timer\tReporter
1\tlo        :     1      V1
\t\t\t\t010000E0     1 0:00000000\t\t0
4\twlan0     :     2      VERSION
\t\t\t\t434CFFEF     1 0:00000000\t\t0
\t\t\t\t010000E0     1 0:00000000\t\t0
"""


@pytest.mark.parametrize(("version", "is_found"), [("V1", True), ("V2", False), ("V3", False)])
def test_only_the_first_version_is_too_old(tmp_path: Path, version: str, is_found: bool) -> None:
    host = HostTree(tmp_path)
    host.link("wlan0")
    host.put(host.proc / "net" / "igmp", LISTED.replace("VERSION", version))
    findings = list(igmp(configuration(), host))
    assert bool(findings) is is_found
    assert all(f.cause.startswith("wlan0 speaks IGMP version 1") for f in findings)


def test_where_nothing_is_listed_nothing_is_said(tmp_path: Path) -> None:
    host = HostTree(tmp_path)
    assert list(igmp(configuration(), host)) == []
    host.link("wlan0")
    assert list(igmp(configuration(), host)) == []
