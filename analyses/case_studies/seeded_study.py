"""The frame of studies that run configurations over seeds: continued, judged, written."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, ClassVar, Self

import numpy as np
from rich.table import Table

from cdpr_drake.analyses.case_studies.drawn_study import DrawnStudy
from cdpr_drake.analyses.reporting import (
    Statement,
    StoppableStudy,
    StudySession,
    WorkProgress,
    code_version,
    finite,
    judged_statements,
    statement_table,
)
from cdpr_drake.analyses.sweeps import SweepTask, run_study_sweep
from cdpr_drake.arrays import Array

Found = Mapping[str, Mapping[str, Array]]
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
    """What judges its statements, see `judged_statements`."""

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
        return judged_statements(self.judges, self.found, self.quick and not self.interrupted)

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

    @abstractmethod
    def number_tables(self) -> list[Table]:
        """Tables of what was found, for the terminal."""

    def tables(self) -> list[Table]:
        """Tables for the terminal, that of the statements last."""
        statements = self.statements()
        last = [statement_table(self.stated, statements)] if statements else []
        return [*self.number_tables(), *last]


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
