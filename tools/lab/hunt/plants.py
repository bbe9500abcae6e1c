"""Bugs that may be planted: where, what stands there instead, and which tests must see it."""

from __future__ import annotations

from typing import NamedTuple


class Plant(NamedTuple):
    """One bug.

    Attributes:
        name: of `tools/planted NAME`.
        path: of the file, in `drslamd/`.
        old: what stands there once.
        new: what is planted in its place.
        tests: files in `tests/`, or parts of them.
    """

    name: str
    path: str
    old: str
    new: str
    tests: tuple[str, ...]


TEN = (
    Plant(
        "window-before-tag",
        "gossip/seal.py",
        "        proof = _tag(",
        "        self.accept(header, once)\n        proof = _tag(",
        ("gossip/test_hostile_network.py", "gossip/test_seal.py"),
    ),
    Plant(
        "unbounded-dict",
        "conditions/health.py",
        "            if len(self._conditions) >= MAX_CONDITIONS:\n                return []\n",
        "",
        ("conditions/test_health.py",),
    ),
    Plant(
        "counter-not-persisted",
        "io/state_store.py",
        '        self.save({**state, "epoch": epoch})\n',
        "        self.save(state)\n",
        ("io/test_state_store.py",),
    ),
    Plant(
        "float-seconds",
        "io/clock.py",
        "time.clock_gettime_ns(time.CLOCK_BOOTTIME) // 1_000",
        "int(time.clock_gettime(time.CLOCK_BOOTTIME)) * 1_000_000",
        ("io/test_clock.py",),
    ),
    Plant(
        "angle-not-wrapped",
        "slam/pose_now.py",
        "np.append(pose[:2], se2.wrap(pose[2]))",
        "np.append(pose[:2], pose[2])",
        ("robot/test_robot.py",),
    ),
    Plant(
        "partial-update",
        "io/state_store.py",
        '        fresh = self.path.with_suffix(".new")\n',
        "        fresh = self.path\n",
        ("io/test_state_store.py",),
    ),
    Plant(
        "sleep-in-loop",
        "daemon.py",
        "        self._timer, now = None, self._clock.now()\n",
        "        self._timer, now = None, self._clock.now()\n        time.sleep(0.3)\n",
        ("test_daemon.py", "deploy/test_watchdog.py"),
    ),
    Plant(
        "swapped-frame",
        "slam/relative_pose/pair_end.py",
        "ka_T_b = se2.compose(a.keyframe_T_body, a_T_b)",
        "ka_T_b = se2.compose(a_T_b, a.keyframe_T_body)",
        ("slam/relative_pose/test_pair_end.py",),
    ),
    Plant(
        "nan-passed",
        "sensors/linktrack/linktrack_input.py",
        "        if not (math.isfinite(metres) and math.isfinite(first_path_db)"
        " and math.isfinite(all_db)):\n"
        "            return RangeRefusal.NOT_FINITE\n",
        "",
        ("sensors/test_border_of_numbers.py",),
    ),
    Plant(
        "wrong-clock",
        "io/clock.py",
        "time.clock_gettime_ns(time.CLOCK_BOOTTIME)",
        "time.time_ns()",
        ("io/test_clock.py",),
    ),
)
"""Those of the plan for reliability."""

SURVIVORS = (
    Plant(
        "wall-clock-of-bytes",
        "io/serial_port.py",
        "SerialData(self._clock.now(), self._port, data)",
        "SerialData(time.time_ns() // 1_000, self._port, data)",
        ("io/test_serial_port.py",),
    ),
    Plant(
        "wall-clock-of-worker",
        "io/worker.py",
        "        now, made = time.monotonic(), self._marks()\n",
        "        now, made = time.time_ns() / 1e9, self._marks()\n",
        ("io/test_worker.py", "io/watch"),
    ),
    Plant(
        "wall-clock-of-sleep",
        "io/watch/sleep_watch.py",
        "since_boot = time.clock_gettime_ns(time.CLOCK_BOOTTIME)",
        "since_boot = time.time_ns()",
        ("io/watch",),
    ),
    Plant(
        "monotonic-stands-in-sleep",
        "io/clock.py",
        "time.clock_gettime_ns(time.CLOCK_BOOTTIME)",
        "time.monotonic_ns()",
        ("io/test_clock.py",),
    ),
    Plant(
        "angle-of-closure",
        "slam/relative_pose/pair_end.py",
        "np.append(moved[:2], se2.wrap(moved[2]))",
        "np.append(moved[:2], moved[2])",
        ("slam/relative_pose/test_pair_end.py",),
    ),
    Plant(
        "angle-of-range",
        "slam/relative_pose/range_sampler.py",
        "turn_a=float(se2.wrap(anchor_a.keyframe_T_body[2])),",
        "turn_a=float(anchor_a.keyframe_T_body[2]),",
        ("slam/relative_pose/test_range_sampler.py",),
    ),
    Plant(
        "angle-of-residual",
        "slam/optimizer/factor_errors.py",
        "    error[2] = se2.wrap(error[2])\n",
        "",
        ("slam/optimizer/test_factor_errors.py", "slam/optimizer/test_factors.py"),
    ),
    Plant(
        "angle-of-broadcast",
        "broadcast.py",
        "        moved[2] = se2.wrap(moved[2])\n",
        "",
        ("robot/test_broadcast.py",),
    ),
    Plant(
        "bound-of-modules",
        "slam/relative_pose/range_buffer.py",
        "            if len(self) >= MAX_UWB_IDS and not self._forget_silent(sample.utime):\n"
        "                return\n",
        "",
        ("slam/test_front_end.py",),
    ),
    Plant(
        "bound-of-log",
        "gossip/replicated_log.py",
        "        self._forget_before(self.end - MAX_ENTRIES)\n",
        "",
        ("gossip/test_replicated_log.py",),
    ),
    Plant(
        "bound-of-repeats",
        "gossip/repeats/log_repeats.py",
        "        if place in self._planned or len(self._planned) < MAX_PLANNED:\n",
        "        if True:\n",
        ("gossip/repeats/test_log_repeats.py",),
    ),
    Plant(
        "bound-of-leaps",
        "gossip/replay_window.py",
        "        elif len(self._ahead) > MAX_LEAPS:\n",
        "        elif False:\n",
        ("gossip/test_replay_window.py",),
    ),
    Plant(
        "bound-of-senders",
        "recording/encoder.py",
        "        if len(self._senders) >= SENDERS:\n            self._senders.clear()\n",
        "",
        ("recording/test_encoder.py",),
    ),
    Plant(
        "bound-of-recording",
        "io/recording/recorder.py",
        "        return self._queued - self._written < MAX_QUEUED\n",
        "        return True\n",
        ("io/recording/test_recorder.py",),
    ),
)
"""Of the kinds that tests of this project once missed."""

PLANTS = {plant.name: plant for plant in (*TEN, *SURVIVORS)}
