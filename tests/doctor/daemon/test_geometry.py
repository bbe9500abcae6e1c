"""How both robots drive."""

from __future__ import annotations

import pytest
from patients import Case, found

from drslamd.doctor.daemon.geometry import REMEDIES, geometry


@pytest.mark.parametrize("verdict", list(REMEDIES))
@pytest.mark.parametrize(("count", "is_found"), [(8, False), (9, True)])
def test_windows_of_which_nearly_all_say_so_are_a_finding(
    verdict: str, count: int, is_found: bool
) -> None:
    case = Case()
    windows = {verdict: count, "too few ranges": 10 - count}
    case.now["pairs"]["1"] |= {"connected": False, "windows": windows}
    said = found(geometry, case)
    assert bool(said) is is_found
    assert all(REMEDIES[verdict] in sentence for sentence in said)
    case.now["pairs"]["1"]["connected"] = True
    assert found(geometry, case) == []


def test_few_windows_say_nothing() -> None:
    case = Case()
    windows = {next(iter(REMEDIES)): 9}
    case.now["pairs"]["1"] |= {"connected": False, "windows": windows}
    assert found(geometry, case) == []
