"""The formats by their names."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drslamd.export import csv_tables, g2o_file, geojson_file, pyfg_file, tum_files


class CannotWrite(Exception):
    """A format that cannot be written here; the text says why, and what to do."""


def write(name: str, folder: Path, answers: Mapping[str, Any]) -> list[Path]:
    """The files of one format, each whole. Of a team that is not localised there are no paths and
    no graph, and what was written of them before stays.

    Args:
        answers: of a daemon, by question.

    Raises:
        CannotWrite: a package is missing, or the format is too small.
        OSError: the folder or a file cannot be made.
    """
    if name == "tum":
        return tum_files.write(folder, answers["trajectory"])
    if name == "geojson":
        try:
            return geojson_file.write(folder, answers["trajectory"])
        except geojson_file.NoSite as error:
            raise CannotWrite(str(error)) from None
    graph = answers["graph"]
    if name == "csv":
        return csv_tables.write(folder, graph)
    if name == "mcap":
        return _mcap(folder, answers)
    if "keyframes" not in graph:
        return []
    try:
        return g2o_file.write(folder, graph) if name == "g2o" else pyfg_file.write(folder, graph)
    except pyfg_file.TooManyRobots as error:
        raise CannotWrite(str(error)) from None


def _mcap(folder: Path, answers: Mapping[str, Any]) -> list[Path]:
    try:
        from drslamd.export.ros2 import team_file
    except ImportError:
        raise CannotWrite(
            'the format mcap needs the package mcap: pip install "drslamd[export]"'
        ) from None
    return team_file.write(folder, answers)
