"""What computed a result: versions, and whether the code is still the same."""

from __future__ import annotations

import hashlib
import platform
from functools import cache
from importlib import import_module
from importlib.metadata import version
from pathlib import Path

PACKAGES = ("cdpr_drake", "cdpr_drake.models", "cdpr_drake.systems", "cdpr_drake.analyses")
"""Whose sources numbers depend on."""

SUFFIXES = (".py", ".yaml")
"""Files that count."""


def package_versions() -> dict[str, str]:
    """Versions that a result depends on."""
    return {"python": platform.python_version(), **_versions()}


@cache
def _versions() -> dict[str, str]:
    """Those of packages, read once in a process: their metadata are files."""
    return {name: version(name) for name in ("cdpr_drake", "drake", "numpy", "numba")}


@cache
def code_version() -> str:
    """Version of cdpr_drake and a hash of its sources and robots, but for the command line.

    Sweeps keep it beside their chunks, so that chunks of other code are not taken for their own.
    """
    folders = [Path(import_module(name).__path__[0]) for name in PACKAGES]
    return f"{version('cdpr_drake')} {hash_of_sources(folders, folders[0] / 'cli')}"


def hash_of_sources(folders: list[Path], without: Path | None = None) -> str:
    """Twelve digits that change with the sources and data in folders, wherever the folders are.

    Args:
        folders: Some may lie in others.
        without: A folder that does not count.
    """
    found: dict[Path, str] = {}
    for folder in folders:  # a file counts with its place in the innermost folder
        for path in folder.rglob("*"):
            if path.suffix in SUFFIXES and (without is None or without not in path.parents):
                place = f"{folder.name}/{path.relative_to(folder).as_posix()}"
                if path not in found or len(place) < len(found[path]):
                    found[path] = place
    hashed = hashlib.sha256()
    for path, place in sorted(found.items(), key=lambda item: item[1]):
        hashed.update(place.encode() + b"\0" + path.read_bytes() + b"\0")
    return hashed.hexdigest()[:12]
