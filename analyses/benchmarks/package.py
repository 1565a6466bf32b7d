"""Benchmark of the package itself: how much it imports, and how much is installed.

Each start is a fresh Python process, whose processor time counts; other programs do not.
"""

from __future__ import annotations

import importlib.util
import resource
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from cdpr_drake.analyses.reporting.timing import TimingRow, interleaved

STARTS = {
    "import cdpr_drake": "import cdpr_drake",
    "cdpr_drake.load_robot": "import cdpr_drake; cdpr_drake.load_robot('acrobot_large')",
    "cdpr --help": "from cdpr_drake.cli.app import main; main(['--help'])",
}
"""What a user waits for before anything is computed, by its name in the table."""

BASELINE = "import pydrake.all"
"""What a user of Drake waits for."""

MEGABYTE = 1e6


def _start(program: str) -> Callable[[], float]:
    def seconds() -> float:
        """Processor time of a process that runs a program [s]."""
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, "-c", program], check=True, stdout=subprocess.DEVNULL)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime

    return seconds


def installed_size(package: str, *, links: bool = True) -> float:
    """Size of an importable package's files without what Python compiled of them [MB].

    Args:
        package: Its name.
        links: Whether folders that are links count, as those of a checkout are.
    """
    spec = importlib.util.find_spec(package)
    assert spec is not None
    assert spec.submodule_search_locations
    return sum(_size(Path(place), links) for place in spec.submodule_search_locations) / MEGABYTE


def _size(folder: Path, links: bool) -> int:
    total = 0
    for path in folder.iterdir():
        if path.is_dir():
            if path.name != "__pycache__" and (links or not path.is_symlink()):
                total += _size(path, links)
        else:
            total += path.stat().st_size
    return total


def package_rows(quick: bool) -> list[TimingRow]:
    """Starts against an import of Drake, and sizes against Drake's."""
    *starts, drake = interleaved(
        [_start(program) for program in (*STARTS.values(), BASELINE)], 1 if quick else 7
    )
    rows = [
        TimingRow(
            name, value, "s", BASELINE, drake, value / drake, ratio_means="of its processor time"
        )
        for name, value in zip(STARTS, starts, strict=True)
    ]
    ours, theirs = installed_size("cdpr_drake"), installed_size("pydrake", links=False)
    return [
        *rows,
        TimingRow(
            "files of cdpr_drake", ours, "MB", "files of pydrake", theirs, ours / theirs,
            ratio_means="of its size",
        ),
    ]  # fmt: skip
