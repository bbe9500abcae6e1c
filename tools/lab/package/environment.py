"""The program and its libraries as one folder, which the system's Python of Debian 12 can use.

Debian 12 lacks pydantic 2, and its scipy, numpy and cantools are not the ones that the tests ran
with. Everything comes as wheels, also on another machine than the robot: pip chooses by Debian
12's Python and C library, not by those of this host. ``versions.txt`` pins each, so that the same
commit gives the same package.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
from importlib.metadata import Distribution, distributions
from pathlib import Path

import tomli

from lab.package.faults import MISSING, Unbuilt

ROOT = Path(__file__).resolve().parents[3]
VERSIONS = Path(__file__).with_name("versions.txt")

PYTHON = "3.11"
GLIBC_MINOR = 36
"""Of Debian 12; wheels for it and everything older run there."""
MACHINES = {"amd64": "x86_64", "arm64": "aarch64"}
"""What Debian and what wheels call a processor."""
EXTRAS = ("can", "view", "export")
"""What a robot may want, of what the project file offers."""

UNUSED_FOLDERS = ("tests", "__pycache__", "include")
UNUSED_SUFFIXES = {".pyi", ".pxd", ".pyx", ".h", ".a", ".f", ".f90", ".c", ".c.in", ".build"}
UNUSED_AT_TOP = ("bin", "lib", "share")
"""Programs, headers and Java of wheels; the daemon needs none."""
UNUSED_RECORDS = ("RECORD", "INSTALLER", "REQUESTED", "direct_url.json", "WHEEL")
"""They name files that are gone, and folders of this host."""

SYSTEM_LIBRARIES = {
    "libc": "libc6",
    "libm": "libc6",
    "libpthread": "libc6",
    "librt": "libc6",
    "libdl": "libc6",
    "ld-linux-x86-64": "libc6",
    "ld-linux-aarch64": "libc6",
    "libgcc_s": "libgcc-s1",
    "libstdc++": "libstdc++6",
    "libglib-2.0": "libglib2.0-0",
    "libz": "zlib1g",
}
"""Who has what the wheels want from the system."""


def extras() -> list[str]:
    """Those of the project file that a robot may want."""
    project = tomli.loads((ROOT / "pyproject.toml").read_text())["project"]
    return [extra for extra in EXTRAS if extra in project["optional-dependencies"]]


def install(target: Path, arch: str, pinned: bool = True) -> None:
    """Everything into `target`, with the versions of ``versions.txt`` or the newest.

    Raises:
        Unbuilt: pip could not, or something has no pin.
    """
    with tempfile.TemporaryDirectory() as folder:
        wheel = _own_wheel(Path(folder))
        platforms = [f"manylinux_2_{n}_{MACHINES[arch]}" for n in range(GLIBC_MINOR, 16, -1)]
        platforms += [f"manylinux2014_{MACHINES[arch]}"]
        options = [f"--platform={platform}" for platform in platforms]
        options += ["--only-binary=:all:", f"--python-version={PYTHON}", "--implementation=cp"]
        options += ["--no-compile", f"--target={target}"]
        options += [f"--constraint={VERSIONS}"] if pinned else []
        _pip("install", *options, f"{wheel}[{','.join(extras())}]")
    loose = sorted(set(versions(target)) - set(VERSIONS.read_text().split())) if pinned else []
    if loose:
        raise Unbuilt(f"{VERSIONS} does not pin {', '.join(loose)}; tools/package --pin does")


def versions(target: Path) -> list[str]:
    """Of the libraries in a folder, as pip pins them."""
    found = [(_normal(one.metadata["Name"]), one.version) for one in installed(target)]
    return sorted(f"{name}=={version}" for name, version in found if name != "drslamd")


def installed(target: Path) -> list[Distribution]:
    """What is in the folder, in the order of the names."""
    found = distributions(path=[str(target)])
    return sorted(found, key=lambda one: _normal(one.metadata["Name"]))


def trim(target: Path) -> None:
    """Take out what a robot never loads, and what tells of this host."""
    for name in UNUSED_AT_TOP:
        shutil.rmtree(target / name, ignore_errors=True)
    for path in sorted(target.rglob("*"), reverse=True):
        if path.is_dir() and path.name in UNUSED_FOLDERS:
            shutil.rmtree(path)
        elif path.suffix in UNUSED_SUFFIXES or (
            path.name in UNUSED_RECORDS and path.parent.name.endswith(".dist-info")
        ):
            path.unlink()
        elif path.is_dir() and not any(path.iterdir()):
            path.rmdir()
    for path in libraries(target):
        _forget_folders_of_the_builder(path)


def libraries(target: Path) -> list[Path]:
    """Every shared library."""
    return sorted(path for path in target.rglob("*.so*") if path.is_file())


def system_packages(target: Path) -> set[str]:
    """Debian packages that the libraries need.

    Raises:
        Unbuilt: one of them wants what no known package has.
    """
    own = {path.name for path in libraries(target)}
    wanted: set[str] = set()
    for path in libraries(target):
        for name in set(_dynamic(path, "NEEDED")) - own:
            stem = name.partition(".so")[0]
            if stem not in SYSTEM_LIBRARIES:
                raise Unbuilt(f"{path.name} wants {name}: which Debian package has it?")
            wanted.add(SYSTEM_LIBRARIES[stem])
    return wanted


def _forget_folders_of_the_builder(path: Path) -> None:
    """A search path outside the package is one that somebody else could fill."""
    for found in _dynamic(path, r"(?:RPATH|RUNPATH)"):
        if found.startswith("/"):
            text = found.encode() + b"\0"
            path.write_bytes(path.read_bytes().replace(text, bytes(len(text))))


def _dynamic(path: Path, kind: str) -> list[str]:
    """Entries of a library's dynamic section."""
    if shutil.which("readelf") is None:
        raise Unbuilt("readelf is not installed; apt install binutils", MISSING)
    done = subprocess.run(
        ["readelf", "--dynamic", "--wide", path], capture_output=True, text=True, check=True
    )
    return re.findall(rf"\({kind}\).*\[(.*)\]", done.stdout)


def _own_wheel(folder: Path) -> Path:
    """Built from a copy, because a build leaves folders behind."""
    source = folder / "source"
    source.mkdir()
    for name in ("pyproject.toml", "README.md"):
        shutil.copy(ROOT / name, source)
    unwanted = shutil.ignore_patterns("__pycache__", "*.egg-info")
    shutil.copytree(ROOT / "drslamd", source / "drslamd", ignore=unwanted)
    _pip("wheel", "--no-deps", f"--wheel-dir={folder}", str(source))
    (wheel,) = folder.glob("*.whl")
    return wheel


def _pip(*arguments: str) -> None:
    command = [sys.executable, "-m", "pip", *arguments, "--quiet", "--disable-pip-version-check"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        reasons = [line for line in done.stderr.splitlines() if line.startswith("ERROR")]
        raise Unbuilt(f"pip {arguments[0]} ended with {done.returncode}: {' '.join(reasons)}")


def _normal(name: str) -> str:
    """As package indexes compare names."""
    return re.sub(r"[-_.]+", "-", name).lower()
