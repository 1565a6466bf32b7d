"""The frame of studies that run configurations over seeds: continued, judged, written.

`DrawnStudy` is how any study is written: its numbers, then the figures that can be drawn of them.
`SeededStudy` adds configurations, seeds and judges.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar, Self

import numpy as np
from matplotlib.figure import Figure
from pydrake.common.yaml import yaml_dump_typed
from rich.table import Table

from cdpr_drake.analyses.reporting.log_files import finite, write_json
from cdpr_drake.analyses.reporting.progress import StoppableStudy, StudySession, WorkProgress
from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
from cdpr_drake.analyses.reporting.statements import Statement, evaluate_checks, statement_table
from cdpr_drake.analyses.sweeps.sweep import run_study_sweep
from cdpr_drake.analyses.sweeps.workers import SweepTask
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS, write_figures
from cdpr_drake.arrays import Array
from cdpr_drake.systems.diagrams.load import load_scenario


class DrawnStudy(ABC):
    """What a study found that can be told and drawn."""

    @abstractmethod
    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON."""

    @abstractmethod
    def drawings(self) -> Mapping[str, Callable[[], Figure]]:
        """What draws the figures that what is finished suffices for, by name; what finds only when
        it draws that data is missing raises NothingToDraw."""

    def write(self, folder: Path, formats: Sequence[str] = DEFAULT_FORMATS) -> dict[str, str]:
        """Writes `results.json`, then the figures, into a folder that exists.

        Returns:
            Of each figure that could not be written, the file and why, in one line.
        """
        write_json(folder / "results.json", self.as_dict())
        return write_figures(folder, self.drawings(), formats)


StudyData = Mapping[str, Mapping[str, Array]]
"""Arrays of what is finished, by the name of the configuration; seeds are their first axis."""


@dataclass(frozen=True, eq=False)
class SeededStudy(DrawnStudy, StoppableStudy):
    """What a study found that runs configurations over seeds; a subclass says what is its own.

    Attributes:
        quick: Whether it was the quick form.
        seeds: Runs of each configuration.
        found: Arrays of the finished configurations, with the runs as first axis.
        progress: Where it stood at the end, and what earlier sessions had left of it.
    """

    quick: bool
    seeds: int
    found: dict[str, dict[str, Array]]
    progress: WorkProgress

    name: ClassVar[str]
    """Its name for `cdpr study`."""

    judges: ClassVar[Sequence[Callable[[Any], Statement]]]
    """What judges its statements, see `evaluate_checks`."""

    source: ClassVar[str] = ""
    """Where what it repeats stands; may be empty."""

    stated: ClassVar[str] = "What has to hold"
    """Title of the table of its statements."""

    @classmethod
    def run(
        cls,
        tasks: Mapping[str, tuple[SweepTask, int]],
        quick: bool,
        seeds: int,
        session: StudySession,
    ) -> Self:
        """Runs the study; each run is an item of a sweep, whose number is the seed.

        Args:
            tasks: Of each configuration, by name, a dataclass that does its runs, and how many.
            quick: Whether it is the quick form.
            seeds: Runs of a configuration, unless it says otherwise.
            session: How it is run.

        Raises:
            OutputFolderError: The folder belongs to other arguments, or cannot be written.
            SweepError: A local process died.
        """
        told: Any = tasks
        arguments = {
            "cdpr_drake": code_version(),
            "study": cls.name,
            "quick": quick,
            "seeds": seeds,
            "tasks": {
                name: {**asdict(task), "runs": count} for name, (task, count) in told.items()
            },
        }
        result = run_study_sweep(tasks, 1, "runs", arguments, session)
        return cls(quick, seeds, result.finished, result.progress)

    def statements(self) -> list[Statement]:
        """What is stated, and whether it is so; of the quick form names only where runs lack."""
        return evaluate_checks(self.judges, self.found, self.quick and not self.interrupted)

    def about(self) -> dict[str, Any]:
        """What comes first in `as_dict`."""
        source = {"source": self.source} if self.source else {}
        return {"study": self.name, **source, "quick": self.quick}

    @abstractmethod
    def details(self) -> dict[str, Any]:
        """What is its own in `as_dict`."""

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON but what is in `parts.npz`; what is not finite is null."""
        told: dict[str, Any] = finite(
            {
                **self.about(),
                "interrupted": self.interrupted,
                **self.details(),
                "statements": [statement.as_dict() for statement in self.statements()],
            }
        )
        return told

    def setup_dict(self, scenario: str, assumptions: Sequence[str]) -> dict[str, Any]:
        """Of a study whose configurations change one scenario: seeds, versions, what is assumed,
        and the scenario, for `details`."""
        return {
            "seeds": list(range(self.seeds)),
            "versions": package_versions(),
            "assumptions": list(assumptions),
            "scenario": yaml_dump_typed(load_scenario(scenario)),
        }

    def runs_dict(self, columns: Sequence[str]) -> dict[str, Any]:
        """The arrays `runs` of all that is finished, whose columns have these names, for
        `details`."""
        return {
            "columns": list(columns),
            "runs": {name: arrays["runs"].tolist() for name, arrays in self.found.items()},
        }

    @abstractmethod
    def number_tables(self) -> list[Table]:
        """Tables of what was found, for the terminal."""

    def tables(self) -> list[Table]:
        """Tables for the terminal, that of the statements last."""
        statements = self.statements()
        last = [statement_table(self.stated, statements)] if statements else []
        return [*self.number_tables(), *last]


def constants_of(module: ModuleType, *kinds: type) -> dict[str, Any]:
    """Constants of a module that are of these types, by name, for JSON."""
    values = {name: getattr(module, name) for name in dir(module) if name.isupper()}
    return {name: value for name, value in values.items() if isinstance(value, kinds)}


def over_seeds(
    run: Callable[[int], Mapping[str, Array]], start: int, stop: int
) -> dict[str, Array]:
    """Arrays of the runs with seeds start to stop, stacked along a new first axis.

    Args:
        run: Gives the arrays of a seed, of the same names and shapes for all.
        start: First seed.
        stop: Seed after the last one.
    """
    runs = [run(seed) for seed in range(start, stop)]
    return {name: np.array([one[name] for one in runs]) for name in runs[0]}
