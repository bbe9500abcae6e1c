"""The page that walks through the package names only what is there."""

from __future__ import annotations

import ast
import re

import pytest
from places import REPOSITORY

PAGE = REPOSITORY / "drslamd" / "README.md"
STEPS = sorted(set(re.findall(r"`([\w./]+\.py): ([\w.]+)`", PAGE.read_text())))
THINGS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)


def members(body: list[ast.stmt]) -> dict[str, list[ast.stmt]]:
    """What is defined in a module or class, and what is defined inside that."""
    return {node.name: node.body for node in body if isinstance(node, THINGS)}


@pytest.mark.parametrize(("file", "name"), STEPS)
def test_every_step_of_the_walk_exists(file: str, name: str) -> None:
    body = ast.parse((REPOSITORY / file).read_text()).body
    for part in name.split("."):
        assert part in members(body), f"{file} has no {name}"
        body = members(body)[part]


def test_the_walk_leads_through_the_whole_house() -> None:
    rooms = {file.split("/")[1] for file, _ in STEPS if file.startswith("drslamd/")}
    assert {"io", "sensors", "gossip", "slam", "robot.py", "config.py"} <= rooms
    assert len(STEPS) > 40


@pytest.mark.parametrize("equation", ["(1)", "(2)", "(3)"])
def test_the_equations_of_the_paper_stand_on_the_lines_that_compute_them(equation: str) -> None:
    """Where the table of the page says that they are."""
    (row,) = re.findall(rf"\| equation \({equation[1]}\).*", PAGE.read_text())
    for file, _ in re.findall(r"`([\w./]+\.py): ([\w.]+)`", row):
        lines = (REPOSITORY / file).read_text().splitlines()
        assert any(f"# eq. {equation}" in line for line in lines), file
