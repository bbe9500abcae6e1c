"""Every value of a kind that a key does not take: one plain sentence, in words of the file."""

from __future__ import annotations

from typing import Any

import pytest
import tomli
from deploy_helpers import EXAMPLE
from pydantic import BaseModel

from drslamd import config
from drslamd.config import Config, ConfigError, parse
from drslamd.config_wheels import SOURCES, CanWheelSection

WRONG = [
    *("3", "3.5", "nan", "-1e300", "true", '"magic"', "''", "[1]", "[[1]]", "{x = 1}"),
    *("2026-01-31", "07:30:00", "2026-01-31T07:30:00Z"),
]
"""One value of each kind that TOML knows, and some that fit no bounds."""

BASE: dict[str, str] = {
    "robot": "id = 3",
    "team": "insecure = true",
    "uwb": 'port = "/dev/uwb"',
    "wheels": 'source = "kobuki"\nport = "/dev/wheels"',
}
CLASSES = {name for name, of in vars(config).items() if isinstance(of, type)}
FOREIGN = {"Input", "instance", "dictionary", "object", "pydantic", "tomli", "sys", "datetime"}
"""Words of Python and its libraries."""


def faults(text: str) -> list[str]:
    """What is said about a file; nothing when it can be used."""
    try:
        parse(text)
    except ConfigError as error:
        return error.faults
    return []


def file_with(section: str, lines: str) -> str:
    sections = {**BASE, section: lines}
    return "\n".join(f"[{name}]\n{text}" for name, text in sections.items())


def plain_sections() -> dict[str, type[BaseModel]]:
    """Sections of one kind, by their names in the file."""
    found: dict[str, Any] = {
        name: field.annotation
        for name, field in Config.model_fields.items()
        if name not in ("wheels", "beacon")
    }
    return found


def keys() -> list[tuple[str, str, str]]:
    """Section, key, and what else stands there, for each key that there is."""
    plain = plain_sections().items()
    found = [(name, key, "") for name, model in plain for key in model.model_fields]
    for source, model in SOURCES.items():
        tag = f'source = "{source}"\n'
        found += [("wheels", key, tag) for key in model.model_fields if key != "source"]
        if issubclass(model, CanWheelSection):
            can = type(model.model_fields["can"].default).model_fields
            found += [("wheels", f"can.{key}", tag) for key in can]
    return found


def is_plain(sentence: str) -> bool:
    words = set(sentence.replace(":", " ").replace(",", " ").replace(".", " ").split())
    return sentence.isprintable() and not words & (CLASSES | FOREIGN)


@pytest.mark.parametrize("value", WRONG)
def test_a_value_of_another_kind_is_told_what_the_key_takes(value: str) -> None:
    refused = 0
    for section, key, rest in keys():
        said = faults(file_with(section, f"{rest}{key} = {value}"))
        about = [sentence for sentence in said if sentence.startswith(f"{section}.{key} = ")]
        assert all(map(is_plain, said)), said
        for sentence in about:
            assert sentence.partition(": ")[2]
        refused += bool(about)
    assert refused > len(keys()) / 4


@pytest.mark.parametrize("value", ["3", '"rbcd"', "true", "[1]", "2026-01-31", "[]"])
@pytest.mark.parametrize("section", [name for name in Config.model_fields if name != "beacon"])
def test_a_value_in_the_place_of_a_section_is_told_what_stands_there(
    section: str, value: str
) -> None:
    others = "\n".join(f"[{k}]\n{text}" for k, text in BASE.items() if k != section)
    (sentence,) = faults(f"{section} = {value}\n{others}")
    first = next(iter(plain_sections()[section].model_fields)) if section != "wheels" else "source"
    assert sentence.startswith(f"{section} = ")
    assert f": a section, [{section}], with {first}" in sentence
    assert is_plain(sentence)


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ("beacon = 3", "beacon = 3: a section, [[beacon]], with uwb_id, "),
        ("beacon = [3]", "beacon[0] = 3: a section, [[beacon]], with uwb_id, "),
        ("[[beacon]]\nx_m = 1\ny_m = 2", "beacon[0].uwb_id: missing; a whole number, "),
        (
            "[[beacon]]\nuwb_id = 1\nx_m = 1\ny_m = 2\n[[beacon]]\nuwb_id = -2\nx_m = 1\ny_m = 2",
            "beacon[1].uwb_id = -2: a whole number, at least 0",
        ),
        ("[[beacon]]\nuwb_id = 1\nx_m = 1", "beacon[0]: give x_m and y_m, or latitude_deg and"),
        (
            "[[beacon]]\nuwb_id = 1\nx_m = 1\ny_m = 2\nlatitude_deg = 1",
            "beacon[0]: give x_m and y_m, or latitude_deg and",
        ),
        ("[[beacon]]\nuwb_id = 1\nx = 1\nx_m = 1\ny_m = 1", "beacon[0].x = 1: "),
    ],
)
def test_one_of_several_sections_is_named_by_its_number(lines: str, said: str) -> None:
    others = "\n".join(f"[{k}]\n{text}" for k, text in BASE.items())
    is_key = not lines.startswith("[")
    (sentence,) = faults(f"{lines}\n{others}" if is_key else f"{others}\n{lines}")
    assert sentence.startswith(said)
    assert is_plain(sentence)


@pytest.mark.parametrize(
    ("second", "said"),
    [
        ("uwb_id = 2\nlatitude_deg = 48.0\nlongitude_deg = 11.0", "or all latitude_deg"),
        ("uwb_id = 1\nx_m = 3\ny_m = 4", "each module once"),
    ],
)
def test_places_of_a_site_are_of_one_kind_and_of_different_modules(second: str, said: str) -> None:
    others = "\n".join(f"[{k}]\n{text}" for k, text in BASE.items())
    first = "[[beacon]]\nuwb_id = 1\nx_m = 1\ny_m = 2"
    (sentence,) = faults(f"{others}\n{first}\n[[beacon]]\n{second}")
    assert said in sentence


def test_what_belongs_to_a_section_inside_a_section_is_told_as_well() -> None:
    (sentence,) = faults(file_with("wheels", 'source = "agilex"\ntrack_m = 0.5\ncan = "can0"'))
    assert sentence == (
        "wheels.can = 'can0': a section, [wheels.can], with interface, channel, bitrate, options"
    )


def test_a_missing_section_and_a_missing_key_are_told_what_they_are() -> None:
    robot, team, uwb, wheels = faults("")
    assert robot == "robot: missing; a section, [robot], with id, calibration"
    assert team == "team: missing; a section, [team], with key_file, insecure, trust_everyone_on"
    assert uwb.startswith("uwb: missing; a section, [uwb], with port, baud, id, max_range_m, ")
    assert wheels == "wheels: missing; a section, [wheels], with source and what belongs to it"
    (sentence,) = faults(file_with("robot", ""))
    assert sentence == "robot.id: missing; a whole number, at least 0 and at most 254"


@pytest.mark.parametrize(
    ("section", "line", "allowed"),
    [
        ("optimizer", "rate_hz = 0", "a number, above 0 and at most 50"),
        ("consistency", "epsilon = 1.0", "a number, above 0 and below 1"),
        ("uwb", 'port = "x"\nid = -1', "a whole number, at least 0 and at most 4294967295"),
        ("daemon", 'log_level = "loud"', 'allowed are "debug", "info", "warning", "error"'),
        ("daemon", "log_level = 3", 'allowed are "debug", "info", "warning", "error"'),
    ],
)
def test_the_bounds_are_those_of_the_key(section: str, line: str, allowed: str) -> None:
    (sentence,) = faults(file_with(section, line))
    assert sentence.endswith(f": {allowed}")


def test_no_value_and_no_key_makes_a_sentence_long() -> None:
    long = "x" * 10_000
    for line in (f'id = "{long}"', f"id = 3\n{long} = 1", f'id = 3\n"\\n{long}" = 1'):
        assert max(map(len, faults(file_with("robot", line)))) < 200


def test_whole_numbers_serve_as_numbers_and_no_other_kind_serves_as_another() -> None:
    assert parse(file_with("optimizer", "rate_hz = 2")).optimizer.rate_hz == 2.0
    for line in ("id = 3.0", "id = true", 'id = "3"'):
        assert faults(file_with("robot", line))
    for line in ("insecure = 1", 'insecure = "true"'):
        assert faults(file_with("team", line))


@pytest.mark.parametrize("value", ["inf", "-inf", "nan"])
def test_no_key_takes_a_number_that_is_not_finite(value: str) -> None:
    for section, key, rest in keys():
        said = faults(file_with(section, f"{rest}{key} = {value}"))
        assert any(sentence.startswith(f"{section}.{key} = {value}: ") for sentence in said), key


def test_every_kind_of_value_is_tried() -> None:
    tried = {type(tomli.loads(f"x = {value}")["x"]) for value in WRONG}
    example = tomli.loads(EXAMPLE.read_text())
    assert len(tried) == 9
    assert {type(v) for section in example.values() for v in section.values()} <= tried


def test_a_misspelt_key_stands_before_the_one_that_is_missing_for_it() -> None:
    text = """
    robt.id = 1
    team.keyfile = "x"
    wheels.sorce = "kobuki"
    [uwb]
    port = 3
    qzx = 1
    """
    assert [sentence.split(":")[0] for sentence in faults(text)] == [
        "team.keyfile = 'x'",
        "wheels.sorce = 'kobuki'",
        "robt = {...}",
        "uwb.qzx = 1",
        "uwb.port = 3",
        "robot",
        "wheels.source",
    ]
    assert faults(file_with("wheels", "sorce = 3"))[0] == (
        "wheels.sorce = 3: unknown key; did you mean source?"
    )


def test_capitals_hide_no_key() -> None:
    said = faults(file_with("uwb", "port = 'x'").replace("[uwb]", "[UWB]"))
    assert said[0] == "UWB = {...}: unknown key; did you mean uwb?"


def test_a_rule_of_a_whole_section_stands_behind_what_may_be_its_cause() -> None:
    said = faults(file_with("team", "").replace("id = 3", "id = 999"))
    assert [sentence.split(":")[0] for sentence in said] == ["robot.id = 999", "team"]
