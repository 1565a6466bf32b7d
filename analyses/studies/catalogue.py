"""The studies that `cdpr study` knows, by name; a study's module is loaded when it is asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, MutableMapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from rich.table import Table

    from cdpr_drake.analyses.reporting.progress import StudySession
    from cdpr_drake.analyses.studies.framework.case_definition import PublishedNumber
    from cdpr_drake.analyses.studies.framework.study import Study as FramedStudy


class StudyResult(Protocol):
    """What a study returns."""

    @property
    def interrupted(self) -> bool:
        """Whether it was stopped before the end."""

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON."""

    def tables(self) -> list[Table]:
        """Tables for the terminal."""

    def write(self, folder: Path, formats: Sequence[str] = ...) -> Mapping[str, str] | None:
        """Writes numbers, and after them figures in these formats, into a folder that exists.

        Returns:
            Of each figure that could not be written, the file and why, in one line; None where
            there is none.
        """


class Study(Protocol):
    """What runs a study."""

    def __call__(self, quick: bool, session: StudySession) -> StudyResult:
        """Runs it."""


@dataclass(frozen=True)
class StudyEntry:
    """A study, and what is known of it before it is run.

    Attributes:
        run: What runs it; it works in its folder from the start, and continues when it is run
            again.
        repeats: Whether it repeats runs over as many seeds as its session says.
        judges: Names of the statements that it can judge, as its results have them.
        numbers: Printed numbers that it puts beside its own.
        figures: Names of the figures that it can write, without endings.
        recipes: Other recipes by name, each a study of its own, of which only some ask.
    """

    run: Study
    repeats: bool = False
    judges: tuple[str, ...] = ()
    numbers: tuple[PublishedNumber, ...] = ()
    figures: tuple[str, ...] = ()
    recipes: Mapping[str, Study] = field(default_factory=dict)


MODULES = {
    "stability-ranges": "stability_ranges.study",
    "basin": "basin.study",
    "design": "design",
    "planning": "planning.study",
    "proven-paths": "proven_paths.study",
}
"""Modules of this room by study, in the order in which the command line lists them.

A module has its study as `STUDY`, several as `STUDIES`.
"""


class Catalogue(MutableMapping[str, StudyEntry]):
    """Entries by name; their modules are loaded when an entry is asked for, not for names."""

    def __init__(self, modules: Mapping[str, str]) -> None:
        """With the modules of the studies."""
        self._modules = dict(modules)
        self._entries: dict[str, StudyEntry] = {}

    def __getitem__(self, name: str) -> StudyEntry:
        if name not in self._entries:
            self._entries[name] = _entry(name, self._modules[name])
        return self._entries[name]

    def __setitem__(self, name: str, entry: StudyEntry) -> None:
        self._modules.setdefault(name, "")
        self._entries[name] = entry

    def __delitem__(self, name: str) -> None:
        del self._modules[name]
        self._entries.pop(name, None)

    def __contains__(self, name: object) -> bool:
        return name in self._modules

    def __iter__(self) -> Iterator[str]:
        return iter(self._modules)

    def __len__(self) -> int:
        return len(self._modules)


STUDIES = Catalogue(MODULES)
"""All studies."""


def _entry(name: str, place: str) -> StudyEntry:
    """The entry of a study of a module."""
    module = import_module(f"cdpr_drake.analyses.studies.{place}")
    found = [*getattr(module, "STUDIES", ()), getattr(module, "STUDY", None)]
    return entry_of(next(one for one in found if one is not None and one.name == name))


def entry_of(study: FramedStudy) -> StudyEntry:
    """The entry of a study, also of one that is in no module of this room."""
    published = getattr(study.cases, "published", None)  # of a `Plan`, which is long to load
    return StudyEntry(
        study,
        repeats=study.seeds is not None,
        judges=study.names_of_checks(),
        numbers=() if published is None else published(),
        figures=tuple(study.figures),
        recipes=study.recipes,
    )


RESULTS = "results.json"
"""A study's numbers."""


def write_study(result: StudyResult, folder: Path, formats: Sequence[str]) -> dict[str, str]:
    """Writes a study; what fails once its numbers are written is named, and they are kept.

    Returns:
        Of each figure that could not be written, the file and why, in one line.

    Raises:
        Whatever kept the numbers from being written: those of an earlier session that are there
        do not stand for them.
    """
    earlier = _written(folder)
    folder.mkdir(parents=True, exist_ok=True)  # by what kept no runs there, it is not
    try:
        return dict(result.write(folder, formats) or {})
    except Exception as problem:
        if _written(folder) in (None, earlier):
            raise
        return {"figures": (str(problem) or type(problem).__name__).splitlines()[0][:300]}


def _written(folder: Path) -> tuple[int, int] | None:
    """Tells one writing of a study's numbers from another; None where there are none."""
    try:
        found = (folder / RESULTS).stat()
    except OSError:
        return None
    return found.st_ino, found.st_mtime_ns


def studies_that(able: Callable[[StudyEntry], bool]) -> str:
    """Names of the studies of which something is so, in words; cases are a family."""
    names = [name for name, entry in STUDIES.items() if able(entry)]
    cases = [name for name in STUDIES if name.startswith("case-")]
    if cases and all(name in names for name in cases):
        names = [*(name for name in names if name not in cases), "case-*"]
    *most, last = names or ["no study"]
    return f"{', '.join(most)} and {last}" if most else last
