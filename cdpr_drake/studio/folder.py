"""The folder that the studio works in; no path leads out of it."""

from __future__ import annotations

from contextlib import suppress
from itertools import islice
from pathlib import Path
from secrets import token_hex

from cdpr_drake.errors import CdprError, OutputFolderError

MOST_FILES = 500
"""Files that are listed at most."""


def is_within(path: Path, *folders: Path) -> bool:
    """Whether a path leads, also by links, into one of some folders, which are resolved."""
    with suppress(OSError, RuntimeError, ValueError):
        return any(path.resolve().is_relative_to(folder) for folder in folders)
    return False


class WorkingFolder:
    """A folder whose files may be read and written."""

    def __init__(self, root: Path) -> None:
        """Of a folder; raises CdprError where it is none."""
        if not root.is_dir():
            raise CdprError(f"{root}: found no folder; accepted: one that exists, to work in")
        self.root = root.resolve()

    def path(self, name: str) -> Path:
        """The path of a file or folder in it, by its name relative to the folder.

        Raises:
            CdprError: The name leads out of the folder, also by a link, or is none.
        """
        name = name.strip()
        if not name or not name.isprintable():
            raise CdprError(f"name: found {name!r}; accepted: a name in the working folder")
        try:
            path = (self.root / name).resolve()
        except (OSError, RuntimeError) as problem:
            raise CdprError(f"{name[:200]}: cannot be used as a name: {problem}") from problem
        if not path.is_relative_to(self.root):
            raise CdprError(
                f"{name[:200]}: leads out of the working folder; accepted: a name in {self.root}"
            )
        return path

    def shown(self, path: Path) -> str:
        """A path relative to the folder, as the page shows it."""
        return str(path.relative_to(self.root)) if path.is_relative_to(self.root) else path.name

    def files(self, suffixes: tuple[str, ...]) -> list[str]:
        """Names of files with these endings, here and one folder below, sorted."""
        paths = [path for at in ("*", "*/*") for path in sorted(self.root.glob(at))]
        names = (
            self.shown(path) for path in paths
            if path.suffix.lower() in suffixes and path.is_file()
        )  # fmt: skip
        return list(islice((name for name in names if "/." not in f"/{name}"), MOST_FILES))

    def write(self, name: str, text: str, overwrite: bool) -> Path:
        """Writes a file at once, or not at all.

        Raises:
            CdprError: The name leads out of the folder.
            OutputFolderError: The file is there and may not be replaced, or the disk is full.
        """
        path = self.path(name)
        if path.exists() and not overwrite:
            raise OutputFolderError(f"{self.shown(path)}: is there already; replace it, or rename")
        part = path.with_name(f".part-{token_hex(8)}")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            part.write_text(text, encoding="utf-8")
            part.replace(path)
        except OSError as problem:
            with suppress(OSError):  # it may not be there
                part.unlink()
            words = problem.strerror or problem
            raise OutputFolderError(f"{self.shown(path)}: cannot be written: {words}") from problem
        return path
