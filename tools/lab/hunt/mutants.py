"""tools/mutants: small changes to the code, one at a time; do the tests of its file notice?

Exit codes: 0 as many are noticed as asked for, 1 fewer, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import ast
import random
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from lab.hunt.copies import ROOT, copied, ran
from lab.numbers import real, whole
from lab.progress import Progress

FEWER = 1
ROOMS = ("gossip", "sensors", "slam/consistency")
PATIENCE_S = 60.0

EXAMPLES = """\
examples:
  tools/mutants                            some of each file of gossip, sensors and consistency
  tools/mutants gossip/seal.py --each 20   twenty of this file
  tools/mutants --each 2 --survivors       quick; also every mutant that nobody noticed
"""

COMPARED: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
}
COMPUTED: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.FloorDiv,
    ast.FloorDiv: ast.Mult,
    ast.Div: ast.Mult,
    ast.Mod: ast.FloorDiv,
    ast.LShift: ast.RShift,
    ast.RShift: ast.LShift,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
}


class Mutant(NamedTuple):
    """One changed file: in which line, what was changed, and the whole text."""

    line: int
    what: str
    text: str


def main(arguments: list[str] | None = None) -> int:
    """Try them; the exit code."""
    parser = argparse.ArgumentParser(
        prog="tools/mutants",
        description="Small changes to the code, one at a time; do the tests of its file notice?",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("file", nargs="*", metavar="FILE", help="in drslamd/, by default all")
    parser.add_argument(
        "--each", type=whole(1), default=5, metavar="N", help="mutants of each file"
    )
    parser.add_argument("--seed", type=whole(), default=0, help="of the choice")
    parser.add_argument("--least", type=real(0, 1), default=0.0, help="share that is to be noticed")
    parser.add_argument("--survivors", action="store_true", help="name those not noticed")
    options = parser.parse_args(arguments)
    files = options.file or names()
    for name in files:
        if not (ROOT / "drslamd" / name).is_file() or not tests_of(name):
            parser.error(f"{name!r} is no file of drslamd/ with tests of its own")
    found, survivors = _tried(files, options.each, options.seed)
    killed, tried = found["killed"], found["tried"]
    share = killed / max(tried, 1)
    print(f"\n{killed} of {tried} mutants of {len(files)} files are noticed: {100 * share:.0f} %.")
    if options.survivors:
        print("\n".join(survivors))
    return 0 if share >= options.least else FEWER


def names() -> list[str]:
    """Files of the three rooms that have tests of their own."""
    package = ROOT / "drslamd"
    paths = (path for room in ROOMS for path in sorted((package / room).rglob("*.py")))
    found = (str(path.relative_to(package)) for path in paths)
    return [name for name in found if tests_of(name)]


def tests_of(name: str) -> list[str]:
    """The file of tests that bears its name, and that of its room which plays it to strangers."""
    path = Path(name)
    own = Path("tests") / path.parent / f"test_{path.name}"
    room = {"gossip": "tests/gossip/test_hostile_network.py"}
    if not (ROOT / own).is_file():
        return []
    more = room.get(path.parts[0])
    return [str(own), more] if more else [str(own)]


def _tried(files: list[str], each: int, seed: int) -> tuple[Counter[str], list[str]]:
    chance, total, survivors = random.Random(seed), Counter[str](), list[str]()
    progress = Progress("tried", len(files), "files")
    print("| file | noticed |\n| --- | --- |")
    with copied() as folder:
        for done, name in enumerate(files, start=1):
            path = folder / "drslamd" / name
            sound, killed = path.read_text(), 0
            known = places(sound)
            chosen = chance.sample(known, min(each, len(known)))
            for changed in (mutant(sound, at) for at in chosen):
                path.write_text(changed.text)
                is_killed = not ran(folder, tests_of(name), PATIENCE_S, most=1).is_green
                killed += is_killed
                if not is_killed:
                    survivors.append(f"drslamd/{name}:{changed.line}: {changed.what}")
            path.write_text(sound)
            total.update(killed=killed, tried=len(chosen))
            print(f"| `{name}` | {killed} of {len(chosen)} |", flush=True)
            progress(done)
    progress.end()
    return total, survivors


def mutants(text: str) -> Iterator[Mutant]:
    """Every small change that is known here; comments are lost, as nobody runs them."""
    for at in places(text):
        yield mutant(text, at)


def places(text: str) -> list[int]:
    """Nodes that can be changed, by their number in the tree."""
    nodes = list(ast.walk(ast.parse(text)))
    return [at for at, node in enumerate(nodes) if _change(node)]


def mutant(text: str, at: int) -> Mutant:
    """The text with one of its `places` changed."""
    tree = ast.parse(text)
    node = list(ast.walk(tree))[at]
    what = _change(node)
    return Mutant(getattr(node, "lineno", 0), what, ast.unparse(tree))


def _change(node: ast.AST) -> str:
    """Change a node in place; what was done, empty where nothing is to be changed."""
    if isinstance(node, ast.Compare) and type(node.ops[0]) in COMPARED:
        old = node.ops[0]
        node.ops[0] = COMPARED[type(old)]()
        return f"{type(old).__name__} became {type(node.ops[0]).__name__}"
    if isinstance(node, ast.BinOp) and type(node.op) in COMPUTED:
        if any(
            isinstance(side, (ast.Constant, ast.JoinedStr)) and _is_text(side)
            for side in (node.left, node.right)
        ):
            return ""
        before = type(node.op)
        node.op = COMPUTED[before]()
        return f"{before.__name__} became {type(node.op).__name__}"
    if isinstance(node, ast.BoolOp):
        node.op = ast.Or() if isinstance(node.op, ast.And) else ast.And()
        return "and became or" if isinstance(node.op, ast.Or) else "or became and"
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        node.op = ast.UAdd()
        return "not was left out"
    if isinstance(node, ast.Constant) and type(node.value) is int:
        node.value += 1
        return f"{node.value - 1} became {node.value}"
    if isinstance(node, ast.Constant) and type(node.value) is bool:
        node.value = not node.value
        return f"it became {node.value}"
    if isinstance(node, ast.If):
        node.test = ast.UnaryOp(ast.Not(), node.test, lineno=node.lineno, col_offset=0)
        return "the question was turned round"
    return ""


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.JoinedStr) or (
        isinstance(node, ast.Constant) and isinstance(node.value, (str, bytes))
    )


if __name__ == "__main__":
    sys.exit(main())
