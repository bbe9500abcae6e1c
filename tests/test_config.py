"""Twenty-odd ways to get the configuration wrong, each answered by one sentence."""

from __future__ import annotations

import pytest

from drslamd.config import Config, ConfigError, parse

GOOD = """
[robot]
id = 3
[team]
insecure = true
[uwb]
port = "/dev/serial/by-id/uwb"
[wheels]
source = "kobuki"
port = "/dev/serial/by-id/base"
"""


def changed(old: str, new: str) -> str:
    assert old in GOOD
    return GOOD.replace(old, new)


def faults(text: str) -> list[str]:
    with pytest.raises(ConfigError) as caught:
        parse(text)
    return caught.value.faults


def test_the_smallest_file_is_enough_and_the_rest_are_the_papers_values() -> None:
    config = parse(GOOD)
    assert config.robot.id == 3
    assert config.uwb_id == 3
    assert (config.relative_pose.tau, config.relative_pose.delta) == (50, 0.1)
    assert (config.consistency.epsilon, config.optimizer.rank) == (0.1, 5)
    assert config.relative_pose.rate_hz == config.consistency.rate_hz == 1.0


def test_the_uwb_id_may_differ_from_the_robot_id() -> None:
    assert parse(changed("[wheels]", "id = 0x11C60B53\n[wheels]")).uwb_id == 0x11C60B53


WRONG = {
    "an id above 254": (changed("id = 3", "id = 255"), "robot.id", "255", "254"),
    "an id below 0": (changed("id = 3", "id = -1"), "robot.id", "-1", "0"),
    "an id that is no number": (
        changed("id = 3", 'id = "three"'),
        "robot.id",
        "three",
        "a whole number",
    ),
    "no id at all": (changed("id = 3", ""), "robot.id", "", "missing"),
    "neither key nor insecure": (changed("insecure = true", ""), "team", "", "neither"),
    "key and insecure at once": (
        changed("insecure = true", 'insecure = true\nkey_file = "k"'),
        "team",
        "",
        "exclude each other",
    ),
    "a misspelt key": (changed("insecure", "insekure"), "team.insekure", "true", "insecure"),
    "a misspelt section": (changed("[robot]", "[robto]"), "robto", "", "robot"),
    "a section that does not exist": (GOOD + "[magic]\nx = 1", "magic", "", "unknown"),
    "a baud rate below any": (
        changed("[wheels]", "baud = 300\n[wheels]"),
        "uwb.baud",
        "300",
        "1200",
    ),
    "an antenna in millimetres": (
        changed("[wheels]", "antenna_x_m = 120\n[wheels]"),
        "uwb.antenna_x_m",
        "120",
        "5",
    ),
    "no source of odometry": (changed('source = "kobuki"', ""), "wheels.source", "", "kobuki"),
    "an unknown source": (changed("kobuki", "kobold"), "wheels.source", "kobold", "odrive"),
    "a track of nothing": (GOOD + "track_m = 0", "wheels.track_m", "0", "0.01"),
    "a negative track": (GOOD + "track_m = -0.2", "wheels.track_m", "-0.2", "0.01"),
    "a missing wheel port": (
        changed('port = "/dev/serial/by-id/base"', ""),
        "wheels.port",
        "",
        "missing",
    ),
    "roboteq without its scale": (
        changed('"kobuki"', '"roboteq"\ntrack_m = 0.4'),
        "wheels.counts_per_metre",
        "",
        "missing",
    ),
    "a key of another source": (GOOD + "left_axis = 1", "wheels.left_axis", "1", "unknown"),
    "dbc counts without a scale": (
        changed(
            '"kobuki"\nport = "/dev/serial/by-id/base"',
            '"dbc"\ndbc_file = "f"\nmeasures = "counts"\nleft = "A.b"\nright = "A.c"\ntrack_m = 1',
        ),
        "wheels",
        "",
        "counts_per_metre",
    ),
    "dbc twist without its signals": (
        changed(
            '"kobuki"\nport = "/dev/serial/by-id/base"',
            '"dbc"\ndbc_file = "f"\nmeasures = "twist"\ntrack_m = 1',
        ),
        "wheels",
        "",
        "linear and angular",
    ),
    "a significance of one": (
        GOOD + "[consistency]\nepsilon = 1.0",
        "consistency.epsilon",
        "1.0",
        "1",
    ),
    "a window of two samples": (
        GOOD + "[relative_pose]\ntau = 2",
        "relative_pose.tau",
        "2",
        "3",
    ),
    "ranges without noise": (
        GOOD + "[relative_pose]\nrange_sigma_m = 0.0009",
        "relative_pose.range_sigma_m",
        "0.0009",
        "0.001",
    ),
    "modules without a bias": (
        GOOD + "[relative_pose]\nrange_bias_sigma_m = 0.0009",
        "relative_pose.range_bias_sigma_m",
        "0.0009",
        "0.001",
    ),
    "a rate of zero": (GOOD + "[optimizer]\nrate_hz = 0", "optimizer.rate_hz", "0", "0"),
    "a rate that is not finite": (
        GOOD + "[optimizer]\nrate_hz = inf",
        "optimizer.rate_hz",
        "inf",
        "",
    ),
    "an unknown algorithm": (
        GOOD + '[optimizer]\nalgorithm = "gtsam"',
        "optimizer.algorithm",
        "gtsam",
        "banded",
    ),
    "a unicast group": (
        GOOD + '[gossip]\ngroup = "10.0.0.1"',
        "gossip",
        "10.0.0.1",
        "224.0.0.0",
    ),
    "a group that is no address": (
        GOOD + '[gossip]\ngroup = "team"',
        "gossip",
        "team",
        "multicast",
    ),
    "a port above 65535": (GOOD + "[gossip]\nport = 70000", "gossip.port", "70000", "65535"),
    "a url for the native transport": (
        GOOD + '[gossip]\nurl = "udpm://239.0.0.1:1"',
        "gossip",
        "",
        "liblcm",
    ),
    "a section that is a value": (
        'optimizer = "rbcd"\n' + GOOD,
        "optimizer",
        "'rbcd'",
        "a section, [optimizer], with algorithm, rate_hz, rank",
    ),
    "a section that is a list": (
        GOOD + "[[optimizer]]",
        "optimizer",
        "[...]",
        "a section, [optimizer], with algorithm, rate_hz, rank",
    ),
    "wheels that are a value": (
        'wheels = "kobuki"\n' + GOOD[: GOOD.index("[wheels]")],
        "wheels",
        "'kobuki'",
        "a section, [wheels], with source and what belongs to it",
    ),
    "a number in quotes": (changed("id = 3", 'id = "3"'), "robot.id", "'3'", "a whole number"),
    "a word for true": (
        changed("insecure = true", 'insecure = "yes"'),
        "team.insecure",
        "'yes'",
        "true or false",
    ),
    "a number for a text": (
        GOOD + "[daemon]\nstate_dir = 3",
        "daemon.state_dir",
        "3",
        "text in quotes",
    ),
    "a date": (changed("id = 3", "id = 2026-01-31"), "robot.id", "2026-01-31", "a whole number"),
    "a path with a control character": (
        changed("/dev/serial/by-id/uwb", "/dev/\\u0000"),
        "uwb.port",
        "",
        "without control",
    ),
    "a group in other digits": (
        GOOD + '[gossip]\ngroup = "²³⁹.1.1.1"',
        "gossip",
        "²³⁹.1.1.1",
        "224.0.0.0",
    ),
    "a key of two lines": (GOOD + '[gossip]\n"a\\nb" = 1', r"gossip.'a\nb'", "1", "unknown"),
    "a hexadecimal number without end": (
        changed("id = 3", f"id = 0x{'f' * 5_000}"),
        "robot.id",
        "0xffff",
        "254",
    ),
    "a decimal number without end": (
        changed("id = 3", f"id = {'9' * 5_000}"),
        "not valid TOML",
        "",
        "thousands of digits",
    ),
    "brackets without end": (
        changed("id = 3", f"id = {'[' * 5_000}"),
        "not valid TOML",
        "",
        "nested too deep",
    ),
}


@pytest.mark.row("O1")
@pytest.mark.parametrize("name", WRONG)
def test_a_fault_is_one_sentence_with_key_value_and_what_is_allowed(name: str) -> None:
    text, key, value, allowed = WRONG[name]
    matching = [f for f in faults(text) if f.startswith(key)]
    assert matching, faults(text)
    assert value in matching[0]
    assert allowed in matching[0]
    assert "\n" not in matching[0]


def test_a_millimetre_is_noise_enough() -> None:
    section = parse(GOOD + "[relative_pose]\nrange_sigma_m = 0.001\nrange_bias_sigma_m = 0.001")
    assert section.relative_pose.range_sigma_m == section.relative_pose.range_bias_sigma_m == 0.001


def test_all_faults_are_named_at_once() -> None:
    text = changed("id = 3", "id = 999").replace("kobuki", "kobold") + "[gossip]\nttl = 99"
    assert len(faults(text)) == 3


def test_a_syntax_error_names_its_line() -> None:
    (sentence,) = faults(GOOD + "[robot\n")
    assert "line 11" in sentence


def test_file_names_count_from_the_folder_of_the_file() -> None:
    text = changed("insecure = true", 'key_file = "team.key"')
    assert parse(text, "/etc/drslamd").team.key_file == "/etc/drslamd/team.key"
    absolute = changed("insecure = true", 'key_file = "/run/team.key"')
    assert parse(absolute, "/etc/drslamd").team.key_file == "/run/team.key"


RELATIVE = changed('"/dev/serial/by-id/uwb"', '"uwb"').replace('"/dev/serial/by-id/base"', '"base"')


def test_devices_and_folders_count_from_there_too_wherever_a_program_is_started() -> None:
    folders = '[daemon]\nstate_dir = "s"\nstatus_socket = "run/s.sock"\nrecord_dir = "../r"\n'
    config = parse(RELATIVE + folders, "/home/me/robot")
    assert (config.uwb.port, config.wheels.port) == ("/home/me/robot/uwb", "/home/me/robot/base")  # type: ignore[union-attr]
    daemon = config.daemon
    assert (daemon.state_dir, daemon.status_socket) == (
        "/home/me/robot/s",
        "/home/me/robot/run/s.sock",
    )
    assert daemon.record_dir == "/home/me/robot/../r"
    assert parse(GOOD, "/home/me").daemon.state_dir == ""


@pytest.mark.parametrize("key", ["state_dir", "status_socket", "record_dir"])
def test_a_tilde_is_refused_rather_than_made_a_folder_of_that_name(key: str) -> None:
    (sentence,) = faults(f'{GOOD}[daemon]\n{key} = "~/drslamd"')
    assert sentence == (
        f"daemon.{key} = '~/drslamd': ~ stands for no home here: write the whole path"
    )


def test_a_port_without_a_name_is_told_where_names_are() -> None:
    (sentence,) = faults(changed('"/dev/serial/by-id/uwb"', '""'))
    assert sentence.startswith("uwb.port = '': a serial device; ls /dev/serial/by-id")


def test_what_an_editor_puts_before_the_first_line_changes_nothing() -> None:
    assert parse("\ufeff" + GOOD) == parse(GOOD)


@pytest.mark.parametrize(("module", "is_own"), [(3, True), (4, False)])
def test_a_beacon_is_not_the_module_of_this_robot(module: int, is_own: bool) -> None:
    text = f"{GOOD}[[beacon]]\nuwb_id = {module}\nx_m = 1\ny_m = 2"
    if is_own:
        (sentence,) = faults(text)
        assert sentence.startswith("beacon.uwb_id = 3: the module of this robot")
    else:
        assert parse(text).beacon[0].uwb_id == 4


def test_a_configuration_cannot_be_changed() -> None:
    config: Config = parse(GOOD)
    with pytest.raises(Exception, match="frozen"):
        config.robot.id = 4  # type: ignore[misc]
