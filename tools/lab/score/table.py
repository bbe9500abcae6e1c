"""Scores as a table for people."""

from __future__ import annotations

from typing import Any


def lines(scores: dict[str, Any]) -> list[str]:
    """Per robot and team: dead reckoning that was given the true start, against drslamd."""
    out = [
        f"{'':>8}  {'dead reckoning (true start given)':>34}  {'drslamd (no start given)':>26}",
        f"{'':>8}  {'ATE [m]':>17} {'heading [deg]':>16}  {'ATE [m]':>11} {'heading [deg]':>14}",
    ]
    given, found = scores["odometry"], scores
    for robot in sorted(given["robots"]):
        name = f"robot {robot}"
        out.append(_row(name, given["robots"][robot], found["robots"].get(robot)))
    return [*out, _row("team", given["team"], found["team"])]


def _row(name: str, given: dict[str, float], found: dict[str, float] | None) -> str:
    left = f"{name:>8}  {given['ate_rmse_m']:>17.3f} {given['rot_mean_deg']:>16.2f}"
    if found is None:
        return left + f"  {'not localised':>26}"
    return left + f"  {found['ate_rmse_m']:>11.3f} {found['rot_mean_deg']:>14.2f}"
