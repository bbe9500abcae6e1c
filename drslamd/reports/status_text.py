"""The answer to ``status`` for people: what is wrong first, then everything else in a glance."""

from __future__ import annotations

from typing import Any

UNSURE = ("stale", "doubtful")
"""States of the pose of a peer that are worth a word."""


def lines(s: dict[str, Any]) -> list[str]:
    """Text lines of one status answer."""
    pose = s["pose"]
    out = [f"robot {s['robot']}, epoch {s['epoch']}"]
    if s["insecure"]:
        out.append("INSECURE: no team key, anybody on the network can forge messages")
    out += [f"! {sentence}" for sentence in s["problems"]]
    if "frame" in pose:
        out.append(
            f"{pose['state']} in the frame of robot {pose['frame']}: x {pose['x_m']:.2f} m, "
            f"y {pose['y_m']:.2f} m, " + _heading(pose)
        )
    else:
        out.append(pose["state"])  # the problems above say why
    out += [f"? {left['what']}" for left in s.get("hypotheses", ())]
    out += _sensor("uwb", s["uwb"]) + _ranges(s["uwb"]) + _sensor("wheels", s["wheels"])
    network = s["network"]
    out.append(
        f"network {'up' if network['up'] else 'DOWN'} ({network['detail']}), "
        f"{network['bytes_sent']} bytes sent, {network['accepted']} messages accepted"
    )
    out += [f"  refused {count}: {reason}" for reason, count in network["refused"].items()]
    for robot, peer in s["peers"].items():
        out.append(_peer(robot, peer))
    for robot, pair in s["pairs"].items():
        windows = ", ".join(f"{count} {verdict}" for verdict, count in pair["windows"].items())
        state = "connected" if pair["connected"] else "not connected yet"
        out.append(
            f"pair with {robot}: {state}, closures {pair['closures_kept']} kept "
            f"of {pair['closures_seen']} ({windows})"
        )
    out.append(f"group {s['graph']['group'] or 'none'}")
    out += [
        f"module {uwb_id} stands at x {m['x_m']:.2f} m, y {m['y_m']:.2f} m "
        f"(sigma {m['sigma_m']:.2f} m)"
        for uwb_id, m in s["graph"].get("modules", {}).items()
    ]
    out += _site(s.get("site"))
    recording = s.get("recording")
    if recording:
        size = recording["bytes"] / 1e6
        out.append(f"recorded {size:.1f} MB in {recording['folder']}, now {recording['file']}")
    return out


def _site(site: dict[str, Any] | None) -> list[str]:
    if site is None:
        return []
    if "why_not" in site:
        return [f"no frame of the site: {site['why_not']}"]
    line = f"site: known to {site['sigma_m']:.2f} m and {site['sigma_deg']:.1f} deg"
    if "x_m" in site:
        line += f", x {site['x_m']:.2f} m, y {site['y_m']:.2f} m"
        line += f", {site['theta_deg']:.1f} deg" if "theta_deg" in site else ""
    if site["left_out"]:
        line += f"; module {', '.join(map(str, site['left_out']))} does not fit and was moved"
    return [line]


def _heading(pose: dict[str, Any]) -> str:
    if pose["theta_deg"] is None:
        return f"heading not known (sigma {pose['sigma_m']:.2f} m)"
    return (
        f"{pose['theta_deg']:.1f} deg (sigma {pose['sigma_m']:.2f} m, {pose['sigma_deg']:.1f} deg)"
    )


def _sensor(name: str, sensor: dict[str, Any]) -> list[str]:
    age = "never" if sensor["age_s"] is None else f"{sensor['age_s']:.2f} s ago"
    out = [f"{name} port {sensor['port']} {sensor.get('detail', '')}".rstrip() + f", good {age}"]
    refused = {k: v for k, v in sensor["counters"].items() if ".refused." in k and v}
    return out + [f"  {count} {reason}" for reason, count in refused.items()]


def _ranges(uwb: dict[str, Any]) -> list[str]:
    return [
        f"  ranges to module {uwb_id} "
        + (f"(robot {r['robot']})" if r["robot"] is not None else "(no robot says it is its)")
        + f": {r['count']}, {r['age_s']:.2f} s ago"
        for uwb_id, r in uwb["ranges"].items()
    ]


def _peer(robot: str, peer: dict[str, Any]) -> str:
    clock = "clock unknown"
    if peer["clock_offset_ms"] is not None:
        clock = (
            f"clock {peer['clock_offset_ms']:+.1f} ms "
            f"+- {peer['clock_uncertainty_ms']:.1f} ({peer['clock_source']})"
        )
    words = [
        "alive" if peer["alive"] else "SILENT",
        "" if peer["hears_us"] else "does not hear us",
        f"its pose is {peer['pose']}" if peer["pose"] in UNSURE else "",
        f"heard {peer['age_s']:.1f} s ago",
        f"loss {100 * peer['loss']:.0f} %",
        clock,
        "same graph" if peer["same_graph"] else f"lacking {peer['log_entries_lacking']} entries",
    ]
    return f"peer {robot}: " + ", ".join(word for word in words if word)
