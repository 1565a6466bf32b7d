"""Compiled kernels are kept in the user's cache folder, never inside the installed package.

numba would put them beside the sources. There they survive an uninstall as a package without code,
and cannot be written on a read-only or shared installation. Nor does numba notice that a kernel
which another one calls has changed, so each state of the sources has a folder of its own.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
import tempfile
from pathlib import Path

import platformdirs

KEPT = 3
"""Folders of so many states of the sources are kept, the youngest ones."""

NUMBA_VARIABLE = "NUMBA_CACHE_DIR"


def use_kernel_cache() -> None:
    """Tells numba where to keep compiled kernels, unless the user has said so."""
    if os.environ.get(NUMBA_VARIABLE):
        return
    folder = _writable_folder() / _state_of_sources()
    os.environ[NUMBA_VARIABLE] = str(folder)
    if "numba" in sys.modules:  # it has read its environment already
        sys.modules["numba"].config.CACHE_DIR = str(folder)
    _forget_old(folder)


def _writable_folder() -> Path:
    """The user's cache folder, or one for temporary files where there is none."""
    temporary = Path(tempfile.gettempdir()) / f"cdpr_drake-{os.getuid()}"
    try:
        folders = [Path(platformdirs.user_cache_dir("cdpr_drake")), temporary]
    except (OSError, RuntimeError, KeyError):  # no home
        folders = [temporary]
    for folder in folders:
        try:
            (folder / "kernels").mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder / "kernels", os.W_OK):
            return folder / "kernels"
    return Path(tempfile.mkdtemp(prefix="cdpr_drake-kernels-"))


def _state_of_sources() -> str:
    """Twelve digits that change with the time or size of any file of the pure rooms."""
    here, hashed = Path(__file__).parent.parent, hashlib.sha256(sys.version.encode())
    for room in sorted(os.scandir(here), key=lambda entry: entry.name):
        if room.is_dir(follow_symlinks=False) and room.name not in _WITHOUT_KERNELS:
            for path in sorted(Path(room.path).rglob("*.py")):
                stat = path.stat()
                hashed.update(f"{path} {stat.st_size} {stat.st_mtime_ns}\n".encode())
    return hashed.hexdigest()[:12]


_WITHOUT_KERNELS = ("models", "systems", "analyses", "cli", "studio", "kernel_cache", "__pycache__")


def _forget_old(folder: Path) -> None:
    """Removes what was compiled from sources that are no longer in use."""
    if folder.exists():
        return
    try:
        states = sorted(
            (entry for entry in os.scandir(folder.parent) if entry.is_dir()),
            key=lambda entry: entry.stat().st_mtime,
        )
    except OSError:
        return
    for old in states[: max(len(states) - KEPT + 1, 0)]:
        shutil.rmtree(old.path, ignore_errors=True)
