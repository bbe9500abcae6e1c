"""Interpreters share the tests: --share 2/3 runs the second, fifth, eighth of those selected."""

from __future__ import annotations

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--share", type=_part_of, default=(1, 1), metavar="PART/PARTS")


def _part_of(text: str) -> tuple[int, int]:
    part, parts = (int(number) for number in text.split("/"))
    if not 1 <= part <= parts:
        raise ValueError(text)
    return part, parts


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """After marks have selected what runs; a file with many is spread over all parts."""
    part, parts = config.getoption("--share")
    others = [item for number, item in enumerate(items) if number % parts != part - 1]
    if others:
        config.hook.pytest_deselected(items=others)
    items[:] = items[part - 1 :: parts]
