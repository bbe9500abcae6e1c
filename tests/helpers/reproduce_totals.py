"""Figures of tools/reproduce, made up."""

from __future__ import annotations

import numpy as np
from lab.reproduce import table2, window_columns
from lab.reproduce.tally import Tally


def good() -> Tally:
    """A total for which everything is as it ought to be."""
    tally = Tally()
    for k, tau in enumerate(window_columns.TAUS):
        for way, factor in (("nls", 3), ("coarse", 2), ("both", 1)):
            for unit in ("m", "deg"):
                tally.add(f"table1/{tau}/{way}/{unit}", factor / (k + 1))
    for tau in table2.TAUS:
        for epsilon in table2.EPSILONS:
            name = f"table2/{tau}/{epsilon}"
            before = 10.0 if epsilon is None else 6.0
            tally.poses(f"{name}/before", (np.array([before]), np.array([before])))
            for when in ("there", "after"):
                tally.poses(f"{name}/{when}", (np.array([0.5]), np.array([4.1])))
            tally.add(f"{name}/ate", 0.33)
            tally.add(f"{name}/least/ate", 0.32)
            tally.add(f"{name}/rounds", 12)
    tally.add("table4/paper/1/bytes", 1.5e6)
    tally.poses("odometry", (np.array([0.85]), np.array([8.99])))
    tally.poses("drslamd/after", (np.array([0.1]), np.array([1.0])))
    for name in (
        "drslamd/localised",
        "drslamd/claim/below",
        "drslamd/claim/nees",
        "drslamd/published/nees",
        "table1/10/drslamd/claim/below",
    ):
        tally.add(name, 1.0)
    tally.add("drslamd/published/inside", 0.95)
    tally.add("drslamd/claim/wild", 0.0)
    tally.add("table1/10/drslamd/claim/wild", 0.0)
    return tally
