"""What programs left beside a results folder: older results, and hidden folders of killed runs."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import NamedTuple

from cdpr_drake.analyses.reporting.folder_lock import free_folder
from cdpr_drake.analyses.reporting.written_files import (
    MARKER,
    WORK,
    list_all,
    others_in,
    remove_written,
    whole_name,
)

BEFORE = "-before-"
"""What follows the name in that of a hidden folder of older results that are replaced."""

RESULTS = "results.json"
"""A study's numbers, of the runs that are finished."""

FINISHED = ("summary.json", RESULTS)
"""What a folder holds whose data is complete."""


class KeptFiles(NamedTuple):
    """What of a folder whose results were replaced was not this program's: names, and where."""

    names: list[str]
    folder: Path


def sibling_folder(final: Path, what: str = "before") -> Path:
    """Where older results are kept that cannot have their name any longer."""
    return free_folder(final.with_name(f"{final.name}-{what}"))


def remove_older(before: Path, final: Path) -> list[KeptFiles]:
    """Removes older results that have been put aside, but for what is not this program's."""
    names = others_in(before)
    if names and not before.name.startswith(f"{final.name}-kept"):
        kept = sibling_folder(final, "kept")
        before.rename(kept)
        before = kept
    remove_written(before)
    return [KeptFiles(names, before)] if names else []


def hidden_folders(final: Path) -> list[Path]:
    """Hidden folders that programs left which were killed, by their names."""
    named = re.compile(rf"\.{re.escape(final.name)}({WORK}|{BEFORE})[a-z0-9_]+")
    return sorted(
        path
        for path in final.parent.iterdir()
        if named.fullmatch(path.name) and path.is_dir()
        if (path / MARKER).is_file() or _just_made(path)
    )


def _just_made(folder: Path) -> bool:
    """Whether a folder holds nothing but a marker in the making."""
    return all(whole_name(path.name) == MARKER for path in folder.iterdir())


def clear_hidden(final: Path) -> tuple[list[Path], list[KeptFiles]]:
    """Removes hidden folders of killed runs; returns where those with data went, and what is kept.

    Those with data are shown.
    What is kept was among older results of which the program that replaced them was killed.
    """
    recovered, kept = [], []
    for stale in hidden_folders(final):
        finished = any((stale / name).is_file() for name in FINISHED)
        if finished:
            shown = free_folder(final.with_name(f"{final.name}-recovered"))
            stale.chmod(0o755)
            if BEFORE not in stale.name.removeprefix(f".{final.name}"):
                list_all(stale)
            stale.rename(shown)
            recovered.append(shown)
        elif BEFORE in stale.name.removeprefix(f".{final.name}"):
            kept += remove_older(stale, final)
        else:
            shutil.rmtree(stale, ignore_errors=True)
    return recovered, kept
