"""The faults of a configuration, one sentence each: the key, its value, what is allowed.

What is allowed is read off the models. Of pydantic's report only the place and the kind of a fault
are used, so that no wording and no class name of a library reaches whoever writes the file.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Iterator
from types import UnionType
from typing import Annotated, Any, Final, Literal, NamedTuple, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

SHOWN: Final = 60
"""Characters of a value or a key that are repeated."""

_BARE_KEY: Final = re.compile(r"[A-Za-z0-9_-]+")
_KINDS: Final = {
    int: "a whole number",
    float: "a number",
    bool: "true or false",
    str: "text in quotes",
}
_BOUNDS: Final = {"gt": "above", "ge": "at least", "lt": "below", "le": "at most"}

_MISSPELT, _UNKNOWN, _WRONG, _MISSING, _RULE = range(5)
"""Ranks of faults: each may be the cause of those behind it."""
_RANKS: Final = {"missing": _MISSING, "union_tag_not_found": _MISSING, "value_error": _RULE}


class _Place(NamedTuple):
    """A key as it stands in the file, the model that holds it, and its field if it is known."""

    key: str
    model: type[BaseModel]
    field: FieldInfo | None


def sentences(error: ValidationError, root: type[BaseModel]) -> list[str]:
    """What is wrong with a file whose tables should have become a `root`."""
    said = [ranked for fault in error.errors() for ranked in _ranked(fault, root)]
    return [sentence for _, sentence in sorted(said, key=lambda ranked: ranked[0])]


def _ranked(fault: Any, root: type[BaseModel]) -> list[tuple[int, str]]:
    """A fault's sentence with its rank: a misspelt key is why another one is missing, and comes
    first, though pydantic tells it last.
    """
    kind, sentence = fault["type"], _sentence(fault, root)
    if kind == "union_tag_not_found" and isinstance(fault["input"], dict):
        return [*_misspelt_choice(fault, root), (_MISSING, sentence)]
    if kind == "extra_forbidden":
        _, model, _ = _place(fault["loc"], root)
        return [(_MISSPELT if _close(fault["loc"][-1], model.model_fields) else _UNKNOWN, sentence)]
    return [(_RANKS.get(kind, _WRONG), sentence)]


def _misspelt_choice(fault: Any, root: type[BaseModel]) -> list[tuple[int, str]]:
    """Where the key is missing that chooses a section: what was meant to be it."""
    key, _, field = _place(fault["loc"], root)
    assert field is not None
    chooser = str(field.discriminator)
    hint = f"unknown key; did you mean {chooser}?"
    return [
        (_MISSPELT, f"{key}.{_shown_key(name)} = {_shown(fault['input'][name])}: {hint}")
        for name in _close(chooser, fault["input"])
    ]


def one_line(text: str) -> str:
    """Whatever a library says, without its line breaks."""
    return " ".join(text.split())


def _sentence(fault: Any, root: type[BaseModel]) -> str:
    kind, value, (key, model, field) = fault["type"], fault["input"], _place(fault["loc"], root)
    if field is None:
        return f"{key} = {_shown(value)}: unknown key{_nearest(fault['loc'][-1], model)}"
    if kind == "missing":
        return f"{key}: missing; {_allowed(key, field)}"
    if kind == "union_tag_not_found":
        return f"{key}.{field.discriminator}: missing; {_tags(field)}"
    if kind == "union_tag_invalid":
        tag = value.get(field.discriminator)
        return f"{key}.{field.discriminator} = {_shown(tag)}: {_tags(field)}"
    if kind == "value_error":  # a rule of ours, of a section as a whole or of one value
        of = key if _sections(field) else f"{key} = {_shown(value)}"
        return f"{of}: {fault['ctx']['error']}"
    return f"{key} = {_shown(value)}: {_allowed(key, field)}"


def _place(location: Iterable[int | str], root: type[BaseModel]) -> _Place:
    keys: list[str] = []
    model, field, inside = root, None, {"": root}
    parts: Iterator[int | str | None] = iter(location)
    for part in parts:
        # where a key chooses among sections, pydantic names the choice and then the key
        if "" not in inside:
            inside, part = {"": inside[str(part)]}, next(parts, None)
            if part is None:  # the chosen section as a whole
                break
        if isinstance(part, int):  # one of several sections
            keys[-1] += f"[{part}]"
            continue
        keys.append(_shown_key(str(part)))
        model = inside[""]
        field = model.model_fields.get(str(part))
        inside = _sections(field) if field else {}
    return _Place(".".join(keys), model, field)


def _sections(field: FieldInfo) -> dict[str, type[BaseModel]]:
    """The models that a key may hold, by the value that chooses one; "" where there is no choice.

    Empty for a plain value.
    """
    if field.discriminator is not None:
        members = get_args(field.annotation)
        return {_choices(m.model_fields[field.discriminator])[0]: m for m in members}
    if get_origin(field.annotation) is list:
        return {"": get_args(field.annotation)[0]}
    is_section = isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel)
    return {"": field.annotation} if is_section else {}  # type: ignore[dict-item]


def _choices(field: FieldInfo) -> list[str]:
    """Of a Literal."""
    return list(get_args(field.annotation)) if get_origin(field.annotation) is Literal else []


def _allowed(key: str, field: FieldInfo) -> str:
    if field.discriminator is not None:
        return f"a section, [{key}], with {field.discriminator} and what belongs to it"
    for section in _sections(field).values():
        is_one = get_origin(field.annotation) is not list
        name = f"[{key}]" if is_one else f"[[{key.partition('[')[0]}]]"
        return f"a section, {name}, with {', '.join(section.model_fields)}"
    if choices := _choices(field):
        return f"allowed are {_listed(choices)}"
    kind, rules = _kind(field)
    bounds = [
        f"{words} {getattr(rule, name)}"
        for rule in rules
        for name, words in _BOUNDS.items()
        if hasattr(rule, name)
    ]
    return _KINDS[kind] + (f", {' and '.join(bounds)}" if bounds else "")


def _kind(field: FieldInfo) -> tuple[type, list[Any]]:
    """The type of a plain value and what bounds it; that it may also be left out goes unsaid."""
    kind, rules = field.annotation, list(field.metadata)
    if get_origin(kind) in (Union, UnionType):
        kind = next(member for member in get_args(kind) if member is not type(None))
    if get_origin(kind) is Annotated:
        kind, *constraints = get_args(kind)
        rules += [rule for constraint in constraints for rule in constraint.metadata]
    assert isinstance(kind, type)
    return kind, rules


def _tags(field: FieldInfo) -> str:
    return f"allowed are {_listed(_sections(field))}"


def _nearest(name: object, model: type[BaseModel]) -> str:
    allowed = list(model.model_fields)
    close = _close(name, allowed)
    return f"; did you mean {close[0]}?" if close else f"; allowed are {', '.join(allowed)}"


def _close(name: object, allowed: Iterable[str]) -> list[str]:
    return difflib.get_close_matches(str(name)[:SHOWN].lower(), list(allowed), n=1)


def _listed(names: Iterable[str]) -> str:
    return ", ".join(f'"{name}"' for name in names)


def _shown_key(key: str) -> str:
    return _shortened(key if _BARE_KEY.fullmatch(key) else repr(key))


def _shown(value: object) -> str:
    if isinstance(value, list):
        return "[...]" if value else "[]"
    if isinstance(value, dict):
        return "{...}" if value else "{}"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int):
        return _shortened(hex(value) if value.bit_length() > SHOWN else repr(value))
    # dates and times have their own notation
    return _shortened(value.isoformat() if hasattr(value, "isoformat") else repr(value))


def _shortened(text: str) -> str:
    return text if len(text) <= SHOWN else text[: SHOWN - 3] + "..."
