"""Study: tension methods in the loop, by coverage and by speed, beside the Gazebo thesis."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

from cdpr_drake.analyses.statics.tension_query import applicable_methods
from cdpr_drake.analyses.studies.framework.runs import Row, Runs
from cdpr_drake.analyses.studies.framework.study import Case, Form, Study
from cdpr_drake.analyses.studies.tension_methods.coverage import TURNS_DEG, cover
from cdpr_drake.analyses.studies.tension_methods.experiments import (
    EXPERIMENTS,
    GRID,
    OTHER_ROBOT,
    QUICK_GRID,
    THESIS_END,
    THESIS_GAINS,
    THESIS_ROBOT,
    THESIS_START,
    thesis_path,
    trials,
)
from cdpr_drake.analyses.studies.tension_methods.figures import (
    coverage_figure,
    error_figure,
    tension_figure,
)
from cdpr_drake.analyses.studies.tension_methods.gain_figures import gains_figure, gains_name
from cdpr_drake.analyses.studies.tension_methods.start_experiments import (
    START_EXPERIMENTS,
    start_trials,
)
from cdpr_drake.analyses.studies.tension_methods.start_figures import (
    one_step_figure,
    start_figure,
    start_tables,
)
from cdpr_drake.analyses.studies.tension_methods.start_statements import START_CHECKS
from cdpr_drake.analyses.studies.tension_methods.start_trial import run_start_trial
from cdpr_drake.analyses.studies.tension_methods.statements import CHECKS
from cdpr_drake.analyses.studies.tension_methods.tables import coverage_tables, run_tables
from cdpr_drake.analyses.studies.tension_methods.trial import STEP, label_of, run_trial
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem

COVERAGE = "grid"
"""What stands for the experiment of methods on grids of poses."""


def cases(form: Form) -> Iterator[Case]:
    """The runs; then each method on the grid of each robot, where it is timed."""
    for spec in trials(form.quick):
        keys = spec.keys()
        yield Case(name=f"{spec.experiment} {label_of(keys)}", keys=keys, data=spec)
    for start in start_trials(form.quick):
        yield Case(name=start.name(), keys=start.keys(), data=start)
    for name in (THESIS_ROBOT, OTHER_ROBOT):
        robot = load_robot(name)
        for method in applicable_methods(tension_problem(robot, robot.home.transform())):
            yield Case(
                name=f"grid of {name}, {method}",
                keys={"experiment": COVERAGE, "robot": name, "method": method},
                data=QUICK_GRID if form.quick else GRID,
                alone=True,
            )


def measure(case: Case, seed: int) -> Row:
    """A row of `run_trial`, `run_start_trial` or `cover`."""
    if case.keys["experiment"] in START_EXPERIMENTS:
        return run_start_trial(case.data)
    if case.keys["experiment"] != COVERAGE:
        return run_trial(case.data)
    (found,) = cover(case.keys["robot"], case.data, [case.keys["method"]])
    return found.measured


def parameters(form: Form) -> Mapping[str, Any]:
    """What all runs have in common; nothing is random."""
    robot, path = load_robot(THESIS_ROBOT), thesis_path()
    return {
        "experiments": EXPERIMENTS | START_EXPERIMENTS,
        "integrator": "runge_kutta3",
        "integration_step_s": STEP,
        "mass_kg": robot.platform.mass,
        "tension_bounds_n": robot.tension_limits(),
        "printed_start_m": THESIS_START,
        "printed_end_m": THESIS_END,
        "printed_places_are": "of the middle of the platform",
        "start_m": path.start,
        "end_m": path.end,
        "start_and_end_are": "of P, the middle of the bottom face",
        "start_least_shift_m": path.start_limit,
        "end_least_shift_m": path.end_limit,
        "start_shift_m": path.start_shift,
        "end_shift_m": path.end_shift,
        "grid": QUICK_GRID if form.quick else GRID,
        "grid_angles_deg": TURNS_DEG,
    }


def _coverage(runs: Runs) -> Runs:
    return runs(experiment=COVERAGE)


STUDY = Study(
    name="tension-methods",
    title="Tension methods in the loop, by coverage and by speed, beside the Gazebo thesis",
    source="Gazebo thesis, chapter 6",
    cases=cases,
    measure=measure,
    parameters=parameters,
    assumptions=(
        "A verdict is about the words. In the experiments up to acrobot the exact model follows "
        "the trajectory from its start, with tensions near 10 N; start_error and one_step try what "
        "could make them as large as the printed ones.",
    ),
    stated="What the Gazebo thesis states",
    checks=(*CHECKS, *START_CHECKS),
    tables=[run_tables, lambda runs: coverage_tables(_coverage(runs)), start_tables],
    figures={
        **{f"{name}_errors": partial(error_figure, name) for name in EXPERIMENTS},
        **{f"{name}_tensions": partial(tension_figure, name) for name in EXPERIMENTS},
        **{gains_name(method): partial(gains_figure, method) for method in THESIS_GAINS},
        "start_errors": start_figure,
        "one_step": one_step_figure,
        "coverage": lambda runs: coverage_figure(_coverage(runs)),
    },
)
