"""Study: tension methods in the loop, by coverage and by speed, beside the Gazebo thesis."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.reporting.progress import (
    DEFAULT_STUDY_SESSION,
    StoppableStudy,
    StudySession,
    WorkProgress,
)
from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
from cdpr_drake.analyses.reporting.statements import Statement
from cdpr_drake.analyses.statics.tension_query import applicable_methods
from cdpr_drake.analyses.studies.framework.seeded_study import DrawnStudy
from cdpr_drake.analyses.studies.tension_methods.coverage import (
    TURNS_DEG,
    CoverageTask,
    MethodCoverage,
)
from cdpr_drake.analyses.studies.tension_methods.experiments import (
    EXPERIMENTS,
    OTHER_ROBOT,
    THESIS_END,
    THESIS_ROBOT,
    THESIS_START,
    TensionPlan,
    make_plan,
)
from cdpr_drake.analyses.studies.tension_methods.figures import study_drawings
from cdpr_drake.analyses.studies.tension_methods.statements import evaluate_statements
from cdpr_drake.analyses.studies.tension_methods.tables import study_tables
from cdpr_drake.analyses.studies.tension_methods.trial import STEP, TrialResult, TrialTask
from cdpr_drake.analyses.sweeps.sweep import run_study_sweep
from cdpr_drake.analyses.sweeps.workers import SweepTask
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem

RUN, GRID = "run ", "grid of "
"""What the names of tasks begin with."""


@dataclass(frozen=True, eq=False)
class TensionStudy(DrawnStudy, StoppableStudy):
    """What the study found.

    Attributes:
        plan: What was to be run.
        runs: The runs that were finished.
        coverage: Methods on grids of poses, as far as finished.
        progress: Where it stood at the end, and what earlier sessions had left of it.
    """

    plan: TensionPlan
    runs: tuple[TrialResult, ...]
    coverage: tuple[MethodCoverage, ...]
    progress: WorkProgress

    @property
    def statements(self) -> list[Statement]:
        """The thesis' statements that these runs judge."""
        return evaluate_statements(self.runs, self.plan.quick and not self.interrupted)

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON: parameters, versions, runs, coverage, statements."""
        return {
            "study": "tension-methods",
            "quick": self.plan.quick,
            "interrupted": self.interrupted,
            "items": self.progress.counts(),
            "parameters": _parameters(self.plan),
            "versions": package_versions(),
            "experiments": EXPERIMENTS,
            "runs": [run.as_dict() for run in self.runs],
            "coverage": [row.as_dict() for row in self.coverage],
            "statements": [statement.as_dict() for statement in self.statements],
        }

    def tables(self) -> list[Table]:
        """Tables for the terminal."""
        return study_tables(self.plan, self.runs, self.coverage, self.statements)

    def drawings(self) -> Mapping[str, Callable[[], Figure]]:
        """See `study_drawings`."""
        return study_drawings(self.runs, self.coverage)


def study_tension_methods(
    quick: bool = False, session: StudySession = DEFAULT_STUDY_SESSION
) -> TensionStudy:
    """Runs the study; each run, and each method on a grid of poses, is an item of a sweep.

    Args:
        quick: Short runs of few methods on a coarse grid, to see that everything works.
        session: How it is run. Methods on grids, which are timed, are left to this process.

    Raises:
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
        SweepError: A local process died, or the scheduler does not answer or got lost.

    Source: Gazebo thesis, chapter 6.
    """
    plan = make_plan(quick)
    trials = {f"{RUN}{spec.name}": TrialTask(spec) for spec in plan.specs}
    grids = {f"{GRID}{name}": _grid_task(name, plan) for name in (THESIS_ROBOT, OTHER_ROBOT)}
    tasks: dict[str, tuple[SweepTask, int]] = {name: (trial, 1) for name, trial in trials.items()}
    tasks |= {name: (grid, len(grid.methods)) for name, grid in grids.items()}
    arguments = {
        "cdpr_drake": code_version(),
        "study": "tension-methods",
        "quick": quick,
        "runs": {name: trial.spec.arguments() for name, trial in trials.items()},
        "grids": {name: asdict(grid) for name, grid in grids.items()},
    }
    result = run_study_sweep(tasks, 1, "runs", arguments, session, alone=tuple(grids))
    found = result.finished
    return TensionStudy(
        plan,
        tuple(trial.result(found[name]) for name, trial in trials.items() if name in found),
        tuple(
            row for name, grid in grids.items() if name in found for row in grid.rows(found[name])
        ),
        result.progress,
    )


def _grid_task(robot_name: str, plan: TensionPlan) -> CoverageTask:
    robot = load_robot(robot_name)
    methods = applicable_methods(tension_problem(robot, robot.home.transform()))
    return CoverageTask(robot_name, plan.grid, tuple(methods))


def _parameters(plan: TensionPlan) -> dict[str, Any]:
    robot = load_robot(THESIS_ROBOT)
    path = plan.path
    return {
        "seed": None,  # nothing is random
        "integrator": "runge_kutta3",
        "integration_step_s": STEP,
        "mass_kg": robot.platform.mass,
        "tension_bounds_n": list(robot.tension_limits()),
        "printed_start_m": list(THESIS_START),
        "printed_end_m": list(THESIS_END),
        "printed_places_are": "of the middle of the platform",
        "start_m": path.start.tolist(),
        "end_m": path.end.tolist(),
        "start_and_end_are": "of P, the middle of the bottom face",
        "start_least_shift_m": path.start_limit,
        "end_least_shift_m": path.end_limit,
        "start_shift_m": path.start_shift,
        "end_shift_m": path.end_shift,
        "grid": list(plan.grid),
        "grid_angles_deg": [list(turn) for turn in TURNS_DEG],
    }
