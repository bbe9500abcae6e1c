"""What a daemon in good order would say of itself, made up."""

from __future__ import annotations

from typing import Any


def answer() -> dict[str, Any]:
    """Of robot 3, localised, with one peer."""
    pose = {"state": "localised", "frame": 0, "age_s": 0.1, "x_m": 1.0, "y_m": -2.0}
    pose |= {"theta_deg": 90.04, "sigma_m": 0.049, "sigma_deg": 1.5}
    uwb = {"port": "open", "detail": "", "age_s": 0.02, "voltage_v": 4.9, "foreign_id": None}
    uwb |= {"counters": {"frames.accepted": 900, "frames.refused.VOLTAGE": 0}}
    uwb |= {"ranges": {"7": {"robot": 1, "count": 9, "age_s": 0.1}}}
    wheels = {"port": "open", "detail": "", "age_s": 0.005, "path_m": 3.5}
    wheels |= {"counters": {"samples.accepted": 50, "gaps.START": 1}}
    network = {"up": True, "detail": "239.255.76.67:7667 on lo", "bytes_sent": 10, "accepted": 5}
    network |= {"messages_sent": 2, "held_back": {}, "own_echoes": 2, "log_entries_heard_again": 0}
    network |= {"refused": {}, "own_echo_age_s": 0.5, "log_entries_repeated": 0}
    return {
        "robot": 3,
        "epoch": 17,
        "insecure": False,
        "problems": [],
        "conditions": [],
        "pose": pose,
        "uwb": uwb,
        "wheels": wheels,
        "network": network,
        "peers": {"1": peer()},
        "pairs": {"1": pair()},
        "graph": {"group": [1, 3], "keyframes": {"1": 4, "3": 5}},
    }


def peer() -> dict[str, Any]:
    return {
        "alive": True,
        "hears_us": True,
        "pose": "localised",
        "age_s": 0.42,
        "loss": 0.25,
        "clock_offset_ms": -7200.5,
        "clock_uncertainty_ms": 1.5,
        "clock_source": "messages",
        "same_graph": True,
        "log_entries_lacking": 0,
    }


def pair() -> dict[str, Any]:
    windows = {"unique": 5, "ambiguous": 4}
    return {"connected": True, "windows": windows, "closures_seen": 5, "closures_kept": 4}
