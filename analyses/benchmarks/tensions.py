"""Benchmarks of tension distribution: single calls and batches against daqp and Drake's solvers."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable

import numpy as np
from pydrake.solvers import ClarabelSolver, OsqpSolver

from cdpr_drake.analyses.benchmarks.tendon_loop import DaqpLoop
from cdpr_drake.analyses.reporting.timing import (
    Item,
    TimingRow,
    interleaved,
    real_time_row,
    seconds_each,
    seconds_per_call,
)
from cdpr_drake.analyses.simulation.tension_control_run import run_tension_scenario
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.tensions.closed_form_kernel import closed_form
from cdpr_drake.tensions.methods import (
    METHODS,
    Distributor,
    TensionMethod,
    distribute,
    distribute_batch,
)
from cdpr_drake.tensions.problem import TensionProblem, writable
from cdpr_drake.tensions.program import TensionProgram, program_tensions
from cdpr_drake.tensions.quadratic_program_kernel import nearest_tensions, workspace_shape

ROBOT = "acrobot_large"


def tension_rows(quick: bool) -> list[TimingRow]:
    """All rows of this file; `quick` times fewer problems.

    Raises:
        CdprError: The solver daqp, with which everything is compared, is not installed.
    """
    if importlib.util.find_spec("daqp") is None:
        raise CdprError("bench tension needs daqp to compare with: pip install daqp")
    problems = random_problems(200 if quick else 2000)
    repeats = 3 if quick else 9
    rows = single_rows(problems, repeats)
    rows.append(batch_row(problems, repeats))
    rows.append(dynamic_row(1.0 if quick else 8.0))
    rows += method_rows(problems[:20], 2 if quick else 5)
    rows += program_rows(300 if quick else 3000)
    return rows


def random_problems(count: int) -> list[TensionProblem]:
    """Problems of one robot at poses inside its workspace; feasible ones, seeded."""
    robot, random = load_robot(ROBOT), np.random.default_rng(0)
    problems: list[TensionProblem] = []
    while len(problems) < count:
        position = random.uniform([-0.35, -0.35, 0.1], [0.35, 0.35, 0.8])
        X_WP = pose_from_angles(position, random.uniform(-0.2, 0.2, 3))
        problem = tension_problem(robot, X_WP, cables=robot.cable_set(pulleys=False))
        if distribute(problem).status == "feasible":
            problems.append(problem)
    return problems


def _over(problems: list[Item], call: Callable[[Item], object]) -> float:
    """Mean time of a call over problems, or over their arrays [us]."""
    return 1e6 * seconds_each(problems, call)


def _arrays(problems: list[TensionProblem]) -> list[tuple[Array, Array]]:
    """W and wrench of each problem, writable as those of a loop are: kernels take no others."""
    return [(writable(p.W), writable(p.wrench)) for p in problems]


def single_rows(problems: list[TensionProblem], repeats: int) -> list[TimingRow]:
    """Kernels by one call, and the front doors with all checks, against daqp's update and solve."""
    first = problems[0]
    m = first.W.shape[1]
    t, zero, work = np.empty(m), np.zeros(m), np.empty(workspace_shape(*first.W.shape))
    lower, upper = writable(first.lower), writable(first.upper)
    loads = _arrays(problems)
    daqp, ready = DaqpLoop(first), Distributor(first)
    exact, closed, front, loop, other = interleaved(
        [
            lambda: _over(loads, lambda p: nearest_tensions(*p, lower, upper, zero, t)),
            lambda: _over(loads, lambda p: closed_form(work, *p, lower, upper, zero, zero, t)),
            lambda: _over(problems, distribute),
            lambda: _over(loads, lambda p: ready(*p)),
            lambda: _over(loads, lambda p: daqp.solve(*p)),
        ],
        repeats,
    )
    name, meaning = "daqp, model updated", "times faster than daqp"
    return [
        TimingRow(label, value, "us", name, other, other / value, ratio_means=meaning)
        for label, value in (
            ("exact QP, one call", exact),
            ("closed form, one call", closed),
            ("distribute(), prepared problem", front),
            ("Distributor, new W and wrench", loop),
        )
    ]


def batch_row(problems: list[TensionProblem], repeats: int) -> TimingRow:
    """The batch of quadratic programs on one core, per problem, against a loop over daqp."""
    W = np.array([p.W for p in problems])
    w = np.array([p.wrench for p in problems])
    lower, upper = problems[0].lower, problems[0].upper
    loads, daqp = _arrays(problems), DaqpLoop(problems[0])
    batch, loop = interleaved(
        [
            lambda: (
                1e6
                * seconds_per_call(lambda: distribute_batch(W, w, lower, upper, threads=1), 5)
                / len(problems)
            ),
            lambda: _over(loads, lambda p: daqp.solve(*p)),
        ],
        repeats,
    )
    return TimingRow(
        "exact QP, batch on one core",
        batch,
        "us",
        "loop over daqp",
        loop,
        loop / batch,
        ratio_means="times faster than daqp",
    )


def dynamic_row(duration: float) -> TimingRow:
    """The dynamic loop at 1 kHz, RK3 of 1 ms; its ratio is the real-time factor."""
    scenario = load_scenario("caroca_computed_torque", [f"duration={duration}"])
    runs = [run_tension_scenario(scenario) for _ in range(3)]
    return real_time_row("dynamic loop, 1 kHz", duration, [run.wall_time for run in runs])


def method_rows(problems: list[TensionProblem], repeats: int) -> list[TimingRow]:
    """Every method through `distribute`, checks included, and Drake's solvers beside."""
    names = [name for name, method in METHODS.items() if method.takes(2)]
    names.remove("reference_program")
    works: list[Callable[[], float]] = [
        lambda name=name: _over(problems, lambda p: distribute(p, name))  # type: ignore[misc]
        for name in names
    ]
    solvers = {"OSQP": OsqpSolver().id(), "Clarabel": ClarabelSolver().id()}
    works += [
        lambda solver=solver: _over(  # type: ignore[misc]
            problems, lambda p: program_tensions(p, "quadratic_program", solver)
        )
        for solver in solvers.values()
    ]
    figures = interleaved(works, repeats)
    base = figures[names.index("quadratic_program")]
    labels = [f"distribute, {name}" for name in names]
    labels += [f"Drake program, {name}" for name in solvers]
    return [
        TimingRow(
            label,
            value,
            "us",
            "distribute, quadratic_program",
            base,
            value / base,
            ratio_means="times as long",
        )
        for label, value in zip(labels, figures, strict=True)
    ]


def _near(problem: TensionProblem) -> TensionProgram:
    """Near 8 N, first pair of cables within 1 N: a quadratic program."""
    program = TensionProgram(problem)
    program.AddQuadraticCost(8.0, 2.0)
    program.AddLinearConstraint([1.0, -1.0], -1.0, 1.0, of=["cable 1", "cable 2"])
    return program


def _never_slack(problem: TensionProblem) -> TensionProgram:
    """A barrier in Python: a nonlinear program."""
    program = TensionProgram(problem)
    program.AddCost(lambda t: 20.0 * float(np.sum(1.0 / t)))
    return program


def program_rows(count: int) -> list[TimingRow]:
    """A step of methods made of programs along a path, against one of the kernel's, with the wrench
    matrix and wrench of each step and the tensions of the step before."""
    robot, rows = load_robot(ROBOT), []
    angles = np.linspace(0.0, 2.0 * np.pi, count)
    places = np.column_stack([0.2 * np.cos(angles), 0.2 * np.sin(angles), np.full(count, 0.35)])
    cables = robot.cable_set(pulleys=False)
    steps = [
        tension_problem(
            robot, pose_from_angles(place, np.zeros(3)), limits=(1.0, 60.0), cables=cables
        )
        for place in places
    ]
    kernel, loads = Distributor(steps[0]), _arrays(steps)
    for label, build in (("own quadratic program", _near), ("own nonlinear program", _never_slack)):
        name = label.replace(" ", "_")
        method = TensionMethod.from_program(name, build)
        try:
            own = Distributor(steps[0], name)

            def follow(own: Distributor = own) -> None:
                last = None
                for W, wrench in loads:
                    last = own(W, wrench, last).tensions

            follow()
            times = method.step_times
            assert times is not None
            times.restart()
            took, base = interleaved(
                [
                    lambda follow=follow: 1e6 * seconds_per_call(follow, 1) / count,  # type: ignore[misc]
                    lambda: _over(loads, lambda p: kernel(*p)),
                ],
                3,
            )
            rows.append(
                TimingRow(
                    f"{label}, a step (worst {1e6 * times.worst:.0f} us, {times.late} of "
                    f"{times.steps} above 1 ms)",
                    took,
                    "us",
                    "Distributor, quadratic_program",
                    base,
                    took / base,
                    ratio_means="times as long",
                )
            )
        finally:
            del METHODS[name]
    return rows
