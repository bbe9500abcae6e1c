"""Errors as sums."""

from __future__ import annotations

import json

import numpy as np
import pytest
from lab.reproduce.tally import Tally


def test_sums_of_parts_give_mean_and_spread_of_the_whole() -> None:
    rng = np.random.default_rng(7)
    whole = rng.normal(3, 2, 100)
    first, second = Tally(), Tally()
    first.add("x", whole[:30])
    second.add("x", whole[30:])
    first.merge(json.loads(json.dumps(second.sums)))
    spread = first["x"]
    assert spread.n == 100
    assert spread.mean == pytest.approx(whole.mean())
    assert spread.std == pytest.approx(whole.std())
    assert spread.most == whole.max()


def test_what_was_never_measured_is_shown_as_a_dash() -> None:
    assert str(Tally()["nothing"]) == "-"
    assert Tally()["nothing"].n == 0
