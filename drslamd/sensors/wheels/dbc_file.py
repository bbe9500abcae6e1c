"""What a DBC file says of the few signals that somebody asks for.

Tools write such files in the encoding of their computer and with faults that other tools forgive:
signals that overlap, attributes and value names of messages that are gone, units in no quotes. So
only what belongs to the signals asked for is cut out of the file; that is read strictly.
`cantools` reads it; it is imported only when a base needs it.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final

from drslamd.config import ConfigError

if TYPE_CHECKING:
    from cantools.database import Message

_NAMES_SHOWN: Final = 10
_HEAD: Final = 'VERSION ""\nNS_ :\nBS_:\nBU_: X\n'
_MESSAGE: Final = re.compile(r"^[ \t]*BO_\s+(?P<id>\d+)\s+(?P<name>[^\s:]+)\s*:", re.MULTILINE)
_SIGNAL: Final = re.compile(
    r"^[ \t]*SG_\s+(?P<name>[^\s:]+)\s*(?P<page>M|m\d+M?)?\s*:(?P<rest>.*)", re.MULTILINE
)
_OF_A_SIGNAL: Final = re.compile(
    r"^[ \t]*(?P<kind>SIG_VALTYPE_|SG_MUL_VAL_|VAL_)\s+(?P<id>\d+)\s+(?P<name>\S+)\s*:?"
    r"(?P<rest>[^;]*);",
    re.MULTILINE,
)
_COMMENT: Final = re.compile(r'^[ \t]*CM_[^"]*"(?:[^"\\]|\\.)*"\s*;', re.MULTILINE)


def decoded(data: bytes) -> str:
    """The text of a file in the encoding in which it was written, as far as that can be told.

    Raises:
        ValueError: it is no text.
    """
    text = _text(data).replace("\r\n", "\n").replace("\r", "\n").rstrip("\x1a\x00\n ") + "\n"
    if "\x00" in text:
        raise ValueError("not a text file")
    return text


def _text(data: bytes) -> str:
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16")
    # the first character of such a file is ASCII, so its other byte is 0
    for start, encoding in ((data[1:2], "utf-16-le"), (data[:1], "utf-16-be")):
        if start == b"\0" and not len(data) % 2:
            return data.decode(encoding)
    for encoding in ("utf-8-sig", "cp1252"):
        try:
            return data.decode(encoding)
        except UnicodeDecodeError:
            continue
    return data.decode("latin-1")


def messages_of(text: str, paths: dict[str, str]) -> dict[str, Message]:
    """The messages that hold the signals asked for, by the key that asks.

    Args:
        paths: `Message.Signal` by the key of the configuration.

    Raises:
        ConfigError: the file cannot be read, or does not hold them.
    """
    text = _COMMENT.sub("", text)
    blocks = _blocks(text)
    for key, path in paths.items():
        _require(key, path, blocks)
    names = dict.fromkeys(path.split(".")[0] for path in paths.values())
    wanted = {
        name: {p.split(".")[1] for p in paths.values() if p.split(".")[0] == name} for name in names
    }
    cut = _HEAD + "".join(_cut(text, blocks[name][0], wanted[name]) for name in names)
    read = {message.name: message for message in _read(cut)}
    found = {key: read[path.split(".")[0]] for key, path in paths.items()}
    for key, path in paths.items():
        _require_whole(key, path, found[key])
    return found


class _Block:
    """One message as the file has it."""

    def __init__(self, name: str, number: str, text: str) -> None:
        self.name = name
        self.number = number
        self.head = text.splitlines()[0]
        self.signals = list(_SIGNAL.finditer(text))


def _blocks(text: str) -> dict[str, list[_Block]]:
    starts = list(_MESSAGE.finditer(text))
    if not starts:
        raise ConfigError([_not_readable("it has no line that begins with BO_")])
    ends = [match.start() for match in starts[1:]] + [len(text)]
    found: dict[str, list[_Block]] = {}
    for match, end in zip(starts, ends, strict=True):
        block = _Block(match["name"], match["id"], text[match.start() : end].lstrip())
        found.setdefault(block.name, []).append(block)
    return found


def _require(key: str, path: str, blocks: dict[str, list[_Block]]) -> None:
    message, signal = path.split(".")
    there = blocks.get(message)
    if there is None:
        raise ConfigError([_absent(key, path, "message", message, list(blocks))])
    if len(there) > 1:
        fault = f"the DBC file has {len(there)} messages of this name; give them names of their own"
        raise ConfigError([f'wheels.{key} = "{path}": {fault}'])
    names = [match["name"] for match in there[0].signals]
    if signal not in names:
        raise ConfigError([_absent(key, path, "signal", signal, names)])


def _require_whole(key: str, path: str, message: Message) -> None:
    """Are the signals there, and those that say on which page each is?"""
    names, fault = {signal.name for signal in message.signals}, ""
    if path.split(".")[1] not in names:
        fault = "its line in the DBC file is not of the form that it should have"
    for signal in message.signals:
        pager = signal.multiplexer_signal
        if pager is not None and pager not in names:
            fault = f"{signal.name} is on a page of {pager}, which is no signal of the DBC file"
        if signal.start < 0 or signal.length < 1:
            fault = f"{signal.name} has {signal.length} bits from bit {signal.start} on"
    if fault:
        raise ConfigError([f'wheels.{key} = "{path}": {fault}; correct the file'])


def _cut(text: str, block: _Block, names: set[str]) -> str:
    """The message with the signals asked for and those that say which of them is there."""
    kept = [m for m in block.signals if m["name"] in names or (m["page"] or "").endswith("M")]
    lines = [block.head, *(_signal_line(match) for match in kept)]
    of_them = {match["name"] for match in kept}
    for match in _OF_A_SIGNAL.finditer(text):
        if match["id"] == block.number and match["name"] in of_them:
            colon = ": " if match["kind"] == "SIG_VALTYPE_" else ""
            lines.append(f"{match['kind']} {match['id']} {match['name']} {colon}{match['rest']};")
    return "\n".join(lines) + "\n"


def _signal_line(match: re.Match[str]) -> str:
    return f" SG_ {match['name']} {match['page'] or ''} :{match['rest']}"


def _read(text: str) -> list[Any]:
    try:
        from cantools.database import Database, load_string
        from cantools.database.errors import Error
    except ImportError:
        fault = 'wheels.source = "dbc": needs the package cantools (pip install drslamd[can])'
        raise ConfigError([fault]) from None
    try:
        database = load_string(text, database_format="dbc")
    except (Error, ValueError, OverflowError) as error:
        raise ConfigError([_not_readable(" ".join(str(error).split()))]) from None
    assert isinstance(database, Database)  # the other kind comes from CDD files
    return database.messages


def _not_readable(reason: str) -> str:
    return f"wheels.dbc_file: not a DBC file that can be read: {reason}"


def _absent(key: str, path: str, what: str, name: str, there: list[str]) -> str:
    shown = ", ".join(there[:_NAMES_SHOWN]) + (", ..." if len(there) > _NAMES_SHOWN else "")
    return f'wheels.{key} = "{path}": no {what} {name} in the DBC file; there are {shown}'
