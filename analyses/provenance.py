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
    names = ("cdpr_drake", "drake", "numpy", "numba")
    return {"python": platform.python_version(), **{name: version(name) for name in names}}


@cache
def code_version() -> str:
    """Version of cdpr_drake and a hash of its sources and robots.

    Sweeps keep it beside their chunks, so that chunks of other code are not taken for their own.
    """
    hashed = hashlib.sha256()
    folders = sorted({Path(str(import_module(name).__file__)).parent for name in PACKAGES})
    own = folders[0]
    for folder in folders:
        for path in sorted(folder.rglob("*")):
            other = any(f != folder and f.is_relative_to(folder) and path.is_relative_to(f)
                        for f in folders)  # fmt: skip
            if path.suffix in SUFFIXES and not other and own / "cli" not in path.parents:
                hashed.update(path.relative_to(folder).as_posix().encode())
                hashed.update(path.read_bytes())
    return f"{version('cdpr_drake')} {hashed.hexdigest()[:12]}"
