"""Pages of the manual say what the parsers take."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from command_lines import PARSERS, examples
from lab.package import manual
from places import REPOSITORY

from drslamd import cli
from drslamd.cli.parser import Parser, verb

EPOCH = 1_700_000_000
PAGES = manual.pages(cli.parser(), "1.2.3", EPOCH)


def shown(page: str) -> str:
    """As a person reads it."""
    if shutil.which("man") is None or shutil.which("groff") is None:
        pytest.skip("no man or no groff here")
    done = subprocess.run(
        ["man", "--warnings", "--local-file", "-"],
        input=page,
        env={"MANWIDTH": "150", "PATH": "/usr/bin:/bin", "LC_ALL": "C.UTF-8", "MANROFFOPT": "-c"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stderr == ""
    return re.sub(r".\x08", "", done.stdout).replace("\u2010", "-").replace("\u2212", "-")


def tiny() -> Parser:
    """A program with what ours may come to have."""
    made = Parser(prog="fly", description="Go up.")
    made.add_argument("--hidden", help="==SUPPRESS==")
    verbs = made.add_subparsers(metavar="VERB")
    land = verb(verbs, "land", lambda _: 0, "come down", "  fly land --on 'a\\b'\n  .fly")
    land.add_argument("--on", nargs=2, metavar=("X", "Y"), help="not 100 %% sure")
    land.add_argument("--near", help="where")
    land.add_argument("--how", choices=["soft", "hard"], help=".dots first")
    return made


def test_every_verb_has_a_page() -> None:
    assert set(PAGES) == {f"{prog.replace(' ', '-')}.1" for prog in PARSERS}
    assert len(PAGES) > 5


@pytest.mark.parametrize("prog", PARSERS)
def test_every_option_and_example_of_a_help_is_on_its_page(prog: str) -> None:
    text = shown(PAGES[f"{prog.replace(' ', '-')}.1"])
    said = PARSERS[prog].format_help()
    options = set(re.findall(r"(?<![\w-])--?[a-z][\w-]*", said))
    assert {"-h", "--help"} <= options
    assert [option for option in options if option not in text] == []
    for arguments in examples(said):
        assert f"drslamd {' '.join(arguments)}" in text


def test_the_page_of_the_program_leads_to_those_of_its_verbs() -> None:
    text = shown(PAGES["drslamd.1"])
    for name in set(PAGES) - {"drslamd.1"}:
        assert (
            text.count(f"{name.removesuffix('.1')}(1)") == 2
        )  # among the commands, and at the end


def test_the_exit_codes_are_a_section() -> None:
    section = shown(PAGES["drslamd.1"]).partition("\nEXIT STATUS\n")[2].partition("\n\n")[0]
    said = " ".join(section.split())  # lines are justified
    assert said.startswith("0 done, ")
    assert "64 wrong usage" in said


def test_a_page_is_dated_by_what_it_is_told() -> None:
    assert '.TH DRSLAMD-CHECK 1 2023-11-14 "drslamd 1.2.3"' in PAGES["drslamd-check.1"]


def test_what_is_special_to_the_formatter_is_read_as_it_was_written() -> None:
    pages = manual.pages(tiny(), "1", EPOCH)
    text = shown(pages["fly-land.1"])
    for words in (
        "--on X Y",
        "--near NEAR",
        "not 100 % sure",
        "--how {soft,hard}",
        ".dots first",
        r"'a\b'",
    ):
        assert words in text
    assert re.search(r"^ +\.fly$", text, re.MULTILINE)
    assert "hidden" not in shown(pages["fly.1"]).partition("OPTIONS")[2]


def test_a_paragraph_without_a_heading_is_one_of_the_section_before() -> None:
    parser = Parser(prog="fly", epilog="files:\n  a.log\n\nNever written twice: once a day.")
    text = shown(manual.pages(parser, "1", EPOCH)["fly.1"])
    assert re.search(r"^FILES\n +a\.log\n\n +Never written twice: once a day\.$", text, re.M)


def test_the_page_of_the_configuration_is_the_example() -> None:
    example = (REPOSITORY / "etc" / "drslamd.toml").read_text()
    text = shown(manual.configuration_page(example, "1", EPOCH))
    for line in example.splitlines():
        assert line.strip() in text


def test_apropos_finds_a_page_by_its_one_line(tmp_path: Path) -> None:
    name = re.search(r"^NAME\n +(.*)$", shown(PAGES["drslamd-keygen.1"]), re.MULTILINE)
    assert name is not None
    assert name[1] == "drslamd-keygen - make a team key, mode 0600"
