"""Paths and modules by longitude and latitude."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest

from drslamd.export.geojson_file import NoSite, write

SITE = {"site_T_team": [0.0, 0.0, math.pi / 2], "origin_deg": [0.0, 11.0]}
"""On the equator; the x axis of the team leads north."""


def trajectory(**more: Any) -> dict[str, Any]:
    return {
        "frame": 0,
        "robots": {"0": {"poses": [[0, 0, 0], [110.574, 0, 0]]}, "3": {"poses": [[0, 0, 0]]}},
        "modules": {"77": {"x_m": 0.0, "y_m": -111.320, "sigma_m": 0.1}},
        "site": SITE,
        **more,
    }


def test_everything_is_where_it_is_on_earth(tmp_path: Path) -> None:
    (path,) = write(tmp_path, trajectory())
    told = json.loads(path.read_text())
    assert told["type"] == "FeatureCollection"
    one, other, module = told["features"]
    assert one["properties"] == {"robot": 0}
    assert one["geometry"]["type"] == other["geometry"]["type"] == "LineString"
    assert one["geometry"]["coordinates"][1] == pytest.approx([11.0, 0.001], abs=1e-7)
    assert len(other["geometry"]["coordinates"]) == 2
    assert module["properties"] == {"module": 77, "sigma_m": 0.1}
    assert module["geometry"]["coordinates"] == pytest.approx([11.001, 0.0], abs=1e-7)


@pytest.mark.parametrize(
    ("site", "why"),
    [
        (None, r"\[\[beacon\]\]"),
        ({"why_not": "one is known"}, "one is known"),
        ({**SITE, "origin_deg": None}, "latitude_deg"),
    ],
)
def test_without_a_site_nobody_knows_where_on_earth(
    tmp_path: Path, site: dict[str, Any] | None, why: str
) -> None:
    with pytest.raises(NoSite, match=why):
        write(tmp_path, trajectory(site=site))


def test_a_team_that_is_not_localised_has_no_map(tmp_path: Path) -> None:
    assert write(tmp_path, trajectory(frame=None)) == []
