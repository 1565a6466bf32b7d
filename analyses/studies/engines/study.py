"""Study: both engines on every scenario, on robots that are drawn, and on impacts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.reporting.progress import (
    DEFAULT_STUDY_SESSION,
    StoppableStudy,
    StudySession,
    WorkProgress,
)
from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
from cdpr_drake.analyses.reporting.statements import Statement, new_table, statement_table
from cdpr_drake.analyses.studies.engines.figures import engine_figure
from cdpr_drake.analyses.studies.engines.pairs import (
    CATCHING_ORDERS,
    COLUMNS,
    ENERGY_DURATION,
    ENERGY_STEPS,
    METHODS,
    REAL_ORDERS,
    TAUT_ORDERS,
    EnergyTask,
    ImpactTask,
    ScenarioTask,
    TautTask,
)
from cdpr_drake.analyses.studies.engines.statements import (
    column,
    engine_statements,
    scenario_names_in,
)
from cdpr_drake.analyses.studies.framework.seeded_study import DrawnStudy
from cdpr_drake.analyses.sweeps.sweep import run_study_sweep
from cdpr_drake.arrays import Array
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.files import TENSION_CONTROL, scenario_kind, scenario_names
from cdpr_drake.systems.scenarios.run_settings import has_contact

RUNS, QUICK_RUNS = 200, 2
"""Servos with impacts, full and quick."""

LONGEST = 120.0
"""Simulated time after which scenarios of hours are compared [s]."""

MOTIONS, QUICK_MOTIONS = 30, 3
"""Robots that are drawn for taut motions."""

QUICK_SCENARIOS = ("acrobot_pbvs", "planar_computed_torque", "planar_pbvs")
QUICK_DURATION = 0.5
"""Scenarios of the quick form, and how long they run [s]."""

ORDER_TASKS = {
    "order taut": TAUT_ORDERS,
    "order catching": CATCHING_ORDERS,
    "order catching real": REAL_ORDERS,
}
"""Where orders of convergence are measured, by the names of the tasks."""


@dataclass(frozen=True, eq=False)
class EnginesStudy(DrawnStudy, StoppableStudy):
    """What the study found.

    Attributes:
        quick: Whether it was the quick form.
        found: Arrays of the finished tasks.
        progress: Where it stood at the end, and what earlier sessions had left of it.
    """

    quick: bool
    found: dict[str, dict[str, Array]]
    progress: WorkProgress

    def statements(self) -> list[Statement]:
        """What had to be shown, and whether it was."""
        return engine_statements(self.found, self.quick and not self.interrupted)

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON: arguments, versions, pairs of runs, statements."""
        found = self.found
        return {
            "study": "engines",
            "quick": self.quick,
            "interrupted": self.interrupted,
            "items": self.progress.counts(),
            "versions": package_versions(),
            "methods": list(METHODS),
            "steps_s": {name: task.steps() for name, task in ORDER_TASKS.items()},
            "energy_steps_s": list(ENERGY_STEPS),
            "columns": list(COLUMNS),
            "results": {
                name: {key: np.asarray(values).tolist() for key, values in arrays.items()}
                for name, arrays in found.items()
            },
            "statements": [statement.as_dict() for statement in self.statements()],
        }

    def tables(self) -> list[Table]:
        """Tables for the terminal."""
        tables = []
        names = scenario_names_in(self.found)
        if names:
            table = new_table(
                "Scenarios by both engines",
                ("scenario", "plant", "compiled"),
                ("ends at [s]", "path [um]", "end [um]", "error at the end [um]", "slack"),
            )
            for name in names:
                pairs = self.found[f"scenario {name}"]["pairs"]
                row = {key: float(column(pairs, key)[0]) for key in COLUMNS}
                table.add_row(
                    name,
                    *(
                        Outcome(int(row[f"outcome_{engine}"])).name.lower()
                        for engine in ("plant", "compiled")
                    ),
                    f"{row['time_plant_s']:.2f} / {row['time_compiled_s']:.2f}",
                    f"{1e6 * row['distance_m']:.3g}",
                    f"{1e6 * row['final_distance_m']:.3g}",
                    f"{1e6 * row['final_error_plant_m']:.4g} / "
                    f"{1e6 * row['final_error_compiled_m']:.4g}",
                    f"{row['slack_share']:.2f}",
                )
            tables.append(table)
        statements = self.statements()
        if statements:
            tables.append(statement_table("What the engines have to show", statements))
        return tables

    def drawings(self) -> Mapping[str, Callable[[], Figure]]:
        """The one figure of the finished tasks."""
        return {"engines": partial(engine_figure, self.found)}


def study_engines(
    quick: bool = False, session: StudySession = DEFAULT_STUDY_SESSION
) -> EnginesStudy:
    """Runs both engines on all of it; each pair of runs is an item of a sweep.

    Args:
        quick: Few runs, short ones, to see that everything works.
        session: How it is run.

    Raises:
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
        SweepError: A local process died.
    """
    tasks = _tasks(quick)
    arguments = {
        "cdpr_drake": code_version(),
        "study": "engines",
        "quick": quick,
        "tasks": {
            name: {"kind": type(task).__name__, "items": count, **asdict(task)}
            for name, (task, count) in tasks.items()
        },
    }
    result = run_study_sweep(tasks, 1, "runs", arguments, session)
    return EnginesStudy(quick, result.finished, result.progress)


def _tasks(quick: bool) -> dict[str, tuple[Any, int]]:
    names = QUICK_SCENARIOS if quick else scenario_names()
    # One engine only has contact: there is nothing to compare.
    names = tuple(name for name in names if not has_contact(load_scenario(name)))
    short = (f"duration={QUICK_DURATION}",) if quick else ()
    tasks: dict[str, tuple[Any, int]] = {}
    for name in names:
        full = scenario_kind(name) == TENSION_CONTROL
        cut = (f"duration={LONGEST}",) if load_scenario(name).duration > LONGEST else ()
        tasks[f"scenario {name}"] = (ScenarioTask(name, cut if full else short or cut), 1)
    tasks |= {
        "taut motions": (TautTask(), QUICK_MOTIONS if quick else MOTIONS),
        **{name: (task, 1) for name, task in ORDER_TASKS.items()},
        "energy": (EnergyTask(0.5 if quick else ENERGY_DURATION), len(ENERGY_STEPS)),
        "impacts": (ImpactTask(), QUICK_RUNS if quick else RUNS),
    }
    return tasks
