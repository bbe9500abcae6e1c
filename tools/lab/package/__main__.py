"""tools/package: the Debian package by one command.

Exit codes: 0 done, 1 it could not be built, 2 wrong usage, 69 a program that is needed is missing.
"""

from __future__ import annotations

import argparse
import platform
import sys
import tempfile
from pathlib import Path

from lab.package import archive, environment, tree
from lab.package.environment import MACHINES, ROOT, VERSIONS
from lab.package.faults import Unbuilt
from lab.progress import Progress

EXAMPLES = """\
examples:
  tools/package                    out/drslamd_VERSION_ARCH.deb for robots with this processor
  tools/package --arch arm64       for robots with another one, from the same laptop
  tools/package --pin              take the newest libraries from now on: writes versions.txt
"""


def main(arguments: list[str] | None = None) -> int:
    """Run it; the exit code."""
    parser = argparse.ArgumentParser(
        prog="tools/package",
        description="Build the Debian package of drslamd for Debian 12.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    here = {machine: arch for arch, machine in MACHINES.items()}.get(platform.machine())
    parser.add_argument(
        "--arch", choices=[*MACHINES], default=here, required=here is None, help="of the robots"
    )
    parser.add_argument("--out", type=Path, default=ROOT / "out", metavar="FOLDER")
    parser.add_argument("--pin", action="store_true", help="choose the libraries anew, no package")
    options = parser.parse_args(arguments)
    try:
        if options.pin:
            pin(options.arch)
            print(VERSIONS)
        else:
            print(build(options.arch, options.out))
    except Unbuilt as error:
        print(error, file=sys.stderr)
        return error.code
    return 0


def build(arch: str, folder: Path) -> Path:
    """The package, in `folder`.

    Raises:
        Unbuilt: the sentence says why not.
    """
    epoch = tree.source_epoch()
    deb = folder / f"drslamd_{tree.REVISION}_{arch}.deb"
    progress = Progress("package", 2, "steps")
    with tempfile.TemporaryDirectory() as scratch:
        root = Path(scratch) / "tree"
        root.mkdir()
        progress(0)
        control = tree.build(root, arch, epoch)
        progress(1)
        archive.pack(root, control, deb, epoch)
        progress(2)
    progress.end()
    return deb


def pin(arch: str) -> None:
    """Write the newest version of each library that fits.

    Raises:
        Unbuilt: pip finds none.
    """
    with tempfile.TemporaryDirectory() as scratch:
        environment.install(Path(scratch), arch, pinned=False)
        VERSIONS.write_text("".join(f"{line}\n" for line in environment.versions(Path(scratch))))


if __name__ == "__main__":
    raise SystemExit(main())
