"""The first page: read aloud in ten minutes, and nothing on it that the program never says."""

from __future__ import annotations

import ast
import re

import pytest
from places import REPOSITORY

PAGE = (REPOSITORY / "README.md").read_text()
SENTENCES = REPOSITORY / "drslamd" / "conditions" / "sentences.md"
WORDS_PER_MINUTE = 150
"""Of a person who reads to others."""
KILOBYTES = 150
"""Of a picture: a clone stays small."""
SHORTEST = 4
"""Letters of a piece of a sentence that is looked for."""
FILLED_IN = r"\.\.\.|'[^']*'|\"[^\"]*\"|\b(?=\S*\d)\S+|\bin LP mode\b|\bwlan0\b"
"""What the program puts into a sentence, or the page leaves out of it."""


def spoken(text: str) -> list[str]:
    """Words that are read to others: no commands, no places of links."""
    prose = "\n".join(line for line in text.splitlines() if not line.startswith("    "))
    return [word for word in re.sub(r"\]\([^)]*\)", "]", prose).split() if re.search(r"\w", word)]


def said_by_the_program() -> str:
    """Every text of the package, pieces of one sentence joined as they are said."""
    texts: list[str] = []
    for path in (REPOSITORY / "drslamd").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                texts.append(node.value)
            elif isinstance(node, ast.JoinedStr):
                pieces = (v.value if isinstance(v, ast.Constant) else "…" for v in node.values)
                texts.append("".join(map(str, pieces)))
    return "\n".join(texts)


def quoted(text: str) -> list[str]:
    """What a table says that the program says."""
    rows = [line.split(" | ")[0] for line in text.splitlines() if line.startswith("| `")]
    return [span for cell in rows for span in re.findall("`([^`]+)`", cell)]


SAID = said_by_the_program()


def unsaid(sentence: str) -> list[str]:
    """Its pieces that stand nowhere in the program."""
    pieces = (piece.strip(" :;,") for piece in re.split(FILLED_IN, sentence))
    return [piece for piece in pieces if len(piece) >= SHORTEST and piece not in SAID]


def test_it_is_read_aloud_in_ten_minutes() -> None:
    assert len(spoken(PAGE)) <= 10 * WORDS_PER_MINUTE


def test_words_are_counted_as_a_person_reads_them() -> None:
    text = "# Two words\n\nsee [all of it](a/long/way.md), 3 %\n\n    no command | is read\n"
    assert spoken(text) == ["Two", "words", "see", "[all", "of", "it],", "3"]


def test_it_begins_with_what_it_is_and_how_it_looks_and_ends_with_what_goes_wrong() -> None:
    order = [
        "A team of ground robots knows where everyone is",
        "(drslamd/view/live-map.png)",
        "## Two commands",
        "    tools/demo",
        "Wiring: ",
        "## What is published",
        "## When it goes wrong",
    ]
    places = [PAGE.index(words) for words in order]
    assert places == sorted(places)


@pytest.mark.parametrize("name", ["live-map.png", "live-map-phone.png"])
def test_pictures_of_the_live_map_are_shown_and_small(name: str) -> None:
    assert f"drslamd/view/{name}" in PAGE
    size = (REPOSITORY / "drslamd" / "view" / name).stat().st_size
    assert 1_000 < size < 1_000 * KILOBYTES


def test_what_the_tables_say_that_it_says_it_says() -> None:
    """A sentence that was changed in the program and not on the page would mislead."""
    channels = re.compile("DRSLAM_")
    texts = [*quoted(PAGE), *quoted(SENTENCES.read_text())]
    sentences = [text for text in texts if not channels.match(text)]
    assert len(sentences) > 40
    assert {text: unsaid(text) for text in sentences if unsaid(text)} == {}


def test_every_sentence_of_the_first_page_stands_among_all_of_them() -> None:
    longer = SENTENCES.read_text()
    short = [text for text in quoted(PAGE) if not text.startswith("DRSLAM_")]
    assert [text for text in short if re.split(FILLED_IN, text)[0] not in longer] == []


def test_a_sentence_that_nobody_says_would_be_seen() -> None:
    assert unsaid("no other robot is heard") == []
    assert unsaid("no other robot is herd") == ["no other robot is herd"]
