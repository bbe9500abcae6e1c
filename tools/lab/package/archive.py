"""One folder as a Debian package, the same bytes each time."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from lab.package.faults import MISSING, Unbuilt


def pack(tree: Path, control: dict[str, str], deb: Path, epoch: int) -> None:
    """Make `deb` of what lies in `tree` and of the files of `control`, dated by `epoch`.

    An older `deb` stays until the new one is whole.

    Raises:
        Unbuilt: there is no dpkg-deb.
    """
    if shutil.which("dpkg-deb") is None:
        raise Unbuilt("dpkg-deb is not installed; apt install dpkg", MISSING)
    _set_modes(tree)
    sums = _sums(tree)
    folder = tree / "DEBIAN"
    folder.mkdir()
    for name, text in {**control, "md5sums": sums}.items():
        path = folder / name
        path.write_text(text)
        path.chmod(0o644 if name in ("control", "md5sums") else 0o755)
    for path in [tree, *tree.rglob("*")]:
        os.utime(path, (epoch, epoch), follow_symlinks=False)
    deb.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=deb.parent) as scratch:
        made = Path(scratch) / deb.name
        # the bytes of xz depend on the number of threads; level 6 takes five times as long for 18 %
        subprocess.run(
            [
                "dpkg-deb",
                "--root-owner-group",
                "-Zxz",
                "-z1",
                "--threads-max=1",
                "--build",
                tree,
                made,
            ],
            env={**os.environ, "SOURCE_DATE_EPOCH": str(epoch)},
            check=True,
            stdout=subprocess.DEVNULL,
        )
        made.replace(deb)


def _set_modes(tree: Path) -> None:
    """Whatever the umask of the builder is."""
    tree.chmod(0o755)
    for path in tree.rglob("*"):
        if not path.is_symlink():
            is_program = path.is_dir() or path.parent == tree / "usr" / "bin"
            path.chmod(0o755 if is_program else 0o644)


def _sums(tree: Path) -> str:
    """As dpkg --verify reads them."""
    files = sorted(path for path in tree.rglob("*") if path.is_file() and not path.is_symlink())
    sums = ((hashlib.md5(path.read_bytes()).hexdigest(), path) for path in files)
    return "".join(f"{digest}  {path.relative_to(tree)}\n" for digest, path in sums)
