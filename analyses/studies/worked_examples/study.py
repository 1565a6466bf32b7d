"""Runs the study, and what it leaves."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.reporting.progress import DEFAULT_STUDY_SESSION, StudySession, WorkProgress
from cdpr_drake.analyses.reporting.provenance import package_versions
from cdpr_drake.analyses.reporting.statements import Statement, new_table, statement_table
from cdpr_drake.analyses.studies.framework.seeded_study import DrawnStudy
from cdpr_drake.analyses.studies.worked_examples.figures import example_drawings
from cdpr_drake.analyses.studies.worked_examples.motion import (
    DURATION,
    END,
    START,
    by_conditions,
    by_printed_coefficients,
    by_trajectory,
)
from cdpr_drake.analyses.studies.worked_examples.statements import FoundExamples, example_statements
from cdpr_drake.analyses.studies.worked_examples.tensions import (
    LEAST,
    POSES,
    PRINTED,
    ROBOT,
    example_polygon,
    methods_on_grid,
)

GRID, QUICK_GRID = (13, 13, 9), (4, 4, 3)
"""Poses on which methods are compared, along x, y and z."""


@dataclass(frozen=True, eq=False)
class WorkedExamples(DrawnStudy):
    """What the study found.

    Attributes:
        quick: Whether it was the quick form.
        found: As far as it was finished.
        interrupted: Whether it was stopped before the end.
        wall_time: Time it took [s].
    """

    quick: bool
    found: FoundExamples
    interrupted: bool
    wall_time: float

    @property
    def statements(self) -> list[Statement]:
        """What the theses state, and whether it is so."""
        return example_statements(self.found, self.quick and not self.interrupted)

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON: parameters, versions, numbers, statements."""
        return {
            "study": "worked-examples",
            "source": "Gazebo thesis 6.2; servoing thesis 1.3.4",
            "quick": self.quick,
            "interrupted": self.interrupted,
            "wall_time_s": self.wall_time,
            "versions": package_versions(),
            "parameters": {
                "seed": None,  # nothing is random
                "start_m": START.tolist(),
                "end_m": END.tolist(),
                "duration_s": DURATION,
                "robot": ROBOT,
                "poses_m": {name: list(place) for name, place in POSES.items()},
                "least_tension_n": LEAST,
                "grid": list(QUICK_GRID if self.quick else GRID),
            },
            "polygons": {
                name: {
                    "area_n2": one.area,
                    "vertices_n": one.vertices.T.tolist(),
                    "tensions_n": {method: t.tolist() for method, t in one.tensions.items()},
                    "printed_n": list(PRINTED[name]),
                }
                for name, one in self.found.polygons.items()
            },
            "methods": {name: asdict(one) for name, one in self.found.methods.items()},
            "statements": [statement.as_dict() for statement in self.statements],
        }

    def tables(self) -> list[Table]:
        """Tables for the terminal."""
        table = new_table(
            f"Methods at the poses of a grid that {ROBOT} can be held at",
            ("method",),
            ("poses", "solved", "with a negative tension", "processor time [us]"),
        )
        for name, one in self.found.methods.items():
            table.add_row(
                name, str(one.poses), str(one.solved), str(one.pushing), f"{one.microseconds:.2f}"
            )
        return [table, statement_table("What the theses state", self.statements)]

    def drawings(self) -> Mapping[str, Callable[[], Figure]]:
        """See `example_drawings`."""
        return example_drawings(self.found)


def study_worked_examples(
    quick: bool = False, session: StudySession = DEFAULT_STUDY_SESSION
) -> WorkedExamples:
    """Runs the study.

    Args:
        quick: Methods on a coarse grid, timed a few times.
        session: How it is run.
    """
    began = time.perf_counter()
    motions, polygons, methods = {}, {}, {}
    grid = QUICK_GRID if quick else GRID
    steps: list[tuple[str, Callable[[], None]]] = [
        ("trajectory", lambda: motions.update({
            "class": by_trajectory(), "conditions": by_conditions(),
            "printed": by_printed_coefficients(),
        })),
        ("polygons", lambda: polygons.update({name: example_polygon(name) for name in POSES})),
        ("methods on a grid", lambda: methods.update(methods_on_grid(grid, quick))),
    ]  # fmt: skip
    done = 0
    for words, step in steps:
        if session.should_stop is not None and session.should_stop():
            break
        passed = time.perf_counter() - began
        session.tell(WorkProgress(words, done, len(steps), passed, rate="examples/s", items=""))
        step()
        done += 1
    found = FoundExamples(motions, polygons, methods)
    return WorkedExamples(quick, found, done < len(steps), time.perf_counter() - began)
