"""The example configuration teaches every key, tells its true default, and can be used as it is."""

from __future__ import annotations

import itertools
import re
from typing import Any

import pytest
import tomli
from deploy_helpers import EXAMPLE
from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from drslamd.config import BeaconSection, Config, TeamSection, parse
from drslamd.config_wheels import SOURCES, CanWheelSection, SerialWheelSection, WheelSection

SHARED_BY_BASES = {"max_speed_mps", "reverse_left", "reverse_right"}
"""Shown once for all bases, and so is what is below `can.`."""


def lines() -> list[str]:
    return EXAMPLE.read_text().splitlines()


def is_commented_key(line: str) -> bool:
    """Prose has a blank behind the #, a key has none."""
    return re.match(r"#[a-z\[]", line) is not None


def uncommented(text: list[str]) -> list[str]:
    return [line[1:] if is_commented_key(line) else line for line in text]


def blocks() -> dict[str, list[str]]:
    """The lines of each `[wheels]` block, uncommented, by its source."""
    found = {}
    text = uncommented(lines())
    for start, line in enumerate(text):
        if line == "[wheels]":
            end = next(i for i in range(start, len(text)) if not text[i])
            block = text[start:end]
            found[tomli.loads("\n".join(block))["wheels"]["source"]] = block
    return found


def other_sections() -> list[str]:
    """The uncommented lines that are about something else than wheels."""
    out, keep = [], True
    for line in uncommented(lines()):
        if line.startswith("["):
            keep = line not in ("[wheels]", "[[beacon]]")
        if keep:
            out.append(line)
    return out


def with_wheels(source: str) -> str:
    """The example with another base in place of the Kobuki."""
    text, skip, out = lines(), False, []
    for line in text:
        if line == "[wheels]":
            skip = True
        elif not line:
            skip = False
        if not skip and not is_commented_key(line):
            out.append(line)
    return "\n".join(out + blocks()[source])


def default(model: type[BaseModel], key: str) -> Any:
    """The default of a key; None where it has none, or where it depends on other keys."""
    field = model.model_fields[key]
    return None if field.default is PydanticUndefined else field.default


def sections() -> dict[str, type[BaseModel]]:
    found = {}
    for name, field in Config.model_fields.items():
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
            found[name] = field.annotation
    return found


def test_the_example_is_a_configuration_with_no_surprises() -> None:
    config = parse(EXAMPLE.read_text())
    assert config.team == TeamSection(key_file="/etc/drslamd/team.key")
    assert config.uwb.port.startswith("/dev/serial/by-id/")
    assert config.wheels.source == "kobuki"
    for name, section in sections().items():
        if name not in ("robot", "team", "uwb"):
            assert getattr(config, name) == section()


def test_every_line_fits_a_terminal_and_the_whole_fits_a_few_screens() -> None:
    assert max(len(line) for line in lines()) <= 100
    assert len(lines()) <= 175


@pytest.mark.parametrize("name", sections())
def test_every_key_is_shown_with_its_default(name: str) -> None:
    model, shown = sections()[name], tomli.loads("\n".join(other_sections()))[name]
    assert set(shown) == set(model.model_fields)
    if name != "team":  # of its two keys one must be given, so the example chooses
        for key, value in shown.items():
            known = default(model, key)
            assert value == known or known is None, key


@pytest.mark.parametrize("source", SOURCES)
def test_every_key_of_every_base_is_shown_with_its_default(source: str) -> None:
    model, shown = SOURCES[source], tomli.loads("\n".join(blocks()[source]))["wheels"]
    for key, value in shown.items():
        known = default(model, key)
        if key not in ("source", "can", "port"):
            assert value == known or model.model_fields[key].is_required() or not known, key
    of_gyros = {"gyro_noise_deg_per_sqrt_s", "gyro_bias_deg_per_h", "reverse_gyro"}
    own = set(model.model_fields) - SHARED_BY_BASES - of_gyros
    assert own <= set(shown)
    assert set(shown) - own <= SHARED_BY_BASES | of_gyros


def test_every_key_of_a_module_with_coordinates_is_shown() -> None:
    text = uncommented(lines())
    start = text.index("[[beacon]]")
    block = text[start : text.index("", start)]
    (shown,) = tomli.loads("\n".join(block))["beacon"]
    assert set(shown) == set(BeaconSection.model_fields)


def test_what_all_bases_share_is_shown_once() -> None:
    shown = [line.split(" ")[0] for block in blocks().values() for line in block]
    for key in SHARED_BY_BASES:
        assert key in WheelSection.model_fields
        assert shown.count(key) == 1
    for key, field in CanWheelSection.model_fields["can"].default.__class__.model_fields.items():
        assert f"can.{key}" in shown
        value = tomli.loads("\n".join(blocks()["odrive"]))["wheels"]["can"][key]
        assert value == field.default or field.default is None
    assert "port" in SerialWheelSection.model_fields


@pytest.mark.parametrize("source", SOURCES)
def test_each_base_can_take_the_place_of_the_kobuki(source: str) -> None:
    config = parse(with_wheels(source), "/etc/drslamd")
    assert config.wheels.source == source


def test_taking_every_comment_mark_away_changes_nothing() -> None:
    text = [
        line
        for line in other_sections()
        if not line.startswith("insecure") and not line.startswith("trust_")
    ]
    everything, plain = parse("\n".join(text + blocks()["kobuki"])), parse(EXAMPLE.read_text())
    assert everything.uwb_id == plain.uwb_id
    assert everything.model_copy(update={"uwb": plain.uwb}) == plain


def test_the_example_has_a_key_and_says_how_to_make_it() -> None:
    text = EXAMPLE.read_text()
    assert parse(text).team.key_file == "/etc/drslamd/team.key"
    assert not parse(text).team.insecure
    assert "drslamd keygen /etc/drslamd/team.key" in text


def test_every_key_is_explained_where_it_first_appears() -> None:
    """On its line, or on the line above, which may be that of its left twin."""
    explained = {"source"}
    for above, line in itertools.pairwise(lines()):
        name, equals, rest = line.lstrip("#").partition(" = ")
        if equals and not line.startswith("# ") and name not in explained:
            assert "# " in rest or "# " in above, line
            explained.add(name)
