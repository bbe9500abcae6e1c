"""Paths and modules on the map of the world, as GeoJSON: what QGIS and most web maps read.

Only where two modules have latitude and longitude in the configuration (`[[beacon]]`).
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from drslamd.export.files import replaced
from drslamd.slam import se2
from drslamd.slam.points.site import Survey
from drslamd.slam.se2 import Array

DIGITS = 8
"""Of degrees: a millimetre."""


class NoSite(Exception):
    """Nobody knows where on earth the team is; the text says why."""


def write(folder: Path, trajectory: Mapping[str, Any]) -> list[Path]:
    """``team.geojson`` out of an answer to ``trajectory``.

    Raises:
        NoSite: as its text says.
        OSError: the folder or the file cannot be made.
    """
    if trajectory["frame"] is None:
        return []
    site = trajectory.get("site")
    if site is None:
        raise NoSite("geojson needs [[beacon]] with latitude_deg and longitude_deg, at least two")
    if "why_not" in site:
        raise NoSite(f"geojson needs the frame of the site: {site['why_not']}")
    if site["origin_deg"] is None:
        raise NoSite("geojson needs latitude_deg and longitude_deg in [[beacon]], not x_m and y_m")
    latitude, longitude = site["origin_deg"]
    survey = Survey({}, (latitude, longitude))
    site_T_w = np.array(site["site_T_team"])

    def on_earth(places: Array) -> list[list[float]]:
        """Longitude and latitude of places (k, 2)."""
        both = [survey.degrees(place) for place in se2.transform(site_T_w, places)]
        return [[round(lon, DIGITS), round(lat, DIGITS)] for lat, lon in both]

    features = []
    for robot, path in sorted(trajectory["robots"].items(), key=lambda item: int(item[0])):
        line = on_earth(np.array(path["poses"])[:, :2])
        # a line has two ends, also that of a robot which stands
        ends = line if len(line) > 1 else [*line, *line]
        features.append(_feature("LineString", ends, {"robot": int(robot)}))
    for uwb_id, module in sorted(trajectory["modules"].items(), key=lambda item: int(item[0])):
        (place,) = on_earth(np.array([[module["x_m"], module["y_m"]]]))
        named = {"module": int(uwb_id), "sigma_m": module["sigma_m"]}
        features.append(_feature("Point", place, named))
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "team.geojson"
    replaced(path, json.dumps({"type": "FeatureCollection", "features": features}) + "\n")
    return [path]


def _feature(kind: str, coordinates: Any, named: dict[str, Any]) -> dict[str, Any]:
    geometry = {"type": kind, "coordinates": coordinates}
    return {"type": "Feature", "properties": named, "geometry": geometry}
