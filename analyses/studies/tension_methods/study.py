"""Study: tension methods in the loop, by coverage and by speed, beside the Gazebo thesis."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.table import Table

from cdpr_drake.analyses.pictures import DEFAULT_FORMATS
from cdpr_drake.analyses.reporting import (
    ALONE,
    Statement,
    StudySession,
    WorkProgress,
    package_versions,
    write_json,
)
from cdpr_drake.analyses.studies.tension_methods.coverage import TURNS_DEG, MethodCoverage, cover
from cdpr_drake.analyses.studies.tension_methods.experiments import (
    EXPERIMENTS,
    OTHER_ROBOT,
    THESIS_END,
    THESIS_ROBOT,
    THESIS_START,
    TensionPlan,
    make_plan,
)
from cdpr_drake.analyses.studies.tension_methods.figures import write_study_figures
from cdpr_drake.analyses.studies.tension_methods.statements import judge_statements
from cdpr_drake.analyses.studies.tension_methods.tables import study_tables
from cdpr_drake.analyses.studies.tension_methods.trial import STEP, TrialResult, run_trial
from cdpr_drake.models import load_robot

RESULTS = "results.json"
"""Numbers and parameters of the study, rewritten after every run."""

COVERAGE_UNITS = 20.0
"""What the coverage of one robot counts in the progress, as simulated time [s]."""


@dataclass(frozen=True, eq=False)
class TensionStudy:
    """What the study found.

    Attributes:
        plan: What was to be run.
        runs: The runs that were finished.
        coverage: Methods on grids of poses, as far as finished.
        statements: The thesis' statements that these runs judge.
        interrupted: Whether it was stopped before the end.
        wall_time: Time it took [s].
    """

    plan: TensionPlan
    runs: tuple[TrialResult, ...]
    coverage: tuple[MethodCoverage, ...]
    statements: tuple[Statement, ...]
    interrupted: bool
    wall_time: float

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON: parameters, versions, runs, coverage, statements."""
        return {
            "study": "tension-methods",
            "quick": self.plan.quick,
            "interrupted": self.interrupted,
            "wall_time_s": self.wall_time,
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

    def write(self, folder: Path, formats: Sequence[str] = DEFAULT_FORMATS) -> None:
        """Writes `results.json` and the figures into a folder that exists."""
        write_json(folder / RESULTS, self.as_dict())
        write_study_figures(folder, self.runs, self.coverage, formats)


def study_tension_methods(
    quick: bool = False,
    session: StudySession = ALONE,
) -> TensionStudy:
    """Runs the study.

    Args:
        quick: Short runs of few methods on a coarse grid, to see that everything works.
        session: How it is run.

    Source: Gazebo thesis, chapter 6.
    """
    plan = make_plan(quick)
    began = time.perf_counter()
    total = plan.duration + 2.0 * COVERAGE_UNITS
    runs: list[TrialResult] = []
    coverage: list[MethodCoverage] = []
    done = 0.0

    def tell(what: str, share: float) -> None:
        session.tell(WorkProgress(what, done + share, total, time.perf_counter() - began))

    def study(interrupted: bool) -> TensionStudy:
        return TensionStudy(
            plan,
            tuple(runs),
            tuple(coverage),
            tuple(judge_statements(runs, plan.quick and not interrupted)),
            interrupted,
            time.perf_counter() - began,
        )

    for number, spec in enumerate(plan.specs, start=1):
        words = f"{number}/{len(plan.specs)} {spec.experiment}: {spec.label}"
        tell(words, 0.0)
        run = run_trial(spec, lambda now, words=words: tell(words, now), session.should_stop)  # type: ignore[misc]
        if run is None:
            return study(interrupted=True)
        runs.append(run)
        done += spec.duration
        if session.folder is not None:
            write_json(session.folder / RESULTS, study(interrupted=True).as_dict())
    for robot in (THESIS_ROBOT, OTHER_ROBOT):
        grid = f"grid of {robot}: "
        coverage += cover(
            robot,
            plan.grid,
            lambda method, grid=grid: tell(grid + method, 0.0),  # type: ignore[misc]
            session.should_stop,
        )
        if session.should_stop is not None and session.should_stop():
            return study(interrupted=True)
        done += COVERAGE_UNITS
    return study(interrupted=False)


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
