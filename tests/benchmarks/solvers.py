"""Tension distribution against daqp, and against OSQP, Clarabel and SNOPT by Drake."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from ctypes import c_int
from functools import partial
from typing import Any

import daqp
import numpy as np
from pydrake.solvers import ClarabelSolver, OsqpSolver

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
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
from tests.benchmarks.ratios import Ratio, per_call, per_item, ratios

ROBOT = "acrobot_large"

COUNT, FEW = 2000, 20
"""Problems, and those of them that each method solves."""

STEPS = 1000
"""Steps of a loop with programs along a path."""


class DaqpLoop:
    """daqp's model, set up once and updated with each problem, as its users do in a loop."""

    def __init__(self, problem: TensionProblem) -> None:
        """With the sizes and bounds of a problem."""
        n, m = problem.W.shape
        self._upper = np.concatenate([problem.upper, -problem.wrench])
        self._lower = np.concatenate([problem.lower, -problem.wrench])
        sense = np.zeros(m + n, dtype=c_int)
        sense[m:] = 5  # equalities
        self._m = m
        self._model: Any = daqp.Model()
        self._model.setup(np.eye(m), np.zeros(m), problem.W.copy(), self._upper, self._lower, sense)

    def solve(self, W: Array, wrench: Array) -> Any:
        """The least-norm tensions with daqp's other results; bounds as they were set up."""
        np.negative(wrench, out=self._upper[self._m :])
        self._lower[self._m :] = self._upper[self._m :]
        self._model.update(A=W, bupper=self._upper, blower=self._lower)
        return self._model.solve()


def benchmark() -> Iterator[Ratio]:
    """Kernels, loops and batches against daqp; all methods; methods made of programs."""
    problems = random_problems()
    first, loads = problems[0], _arrays(problems)
    solver, loop = DaqpLoop(first), Distributor(first)
    m, lower, upper = first.W.shape[1], writable(first.lower), writable(first.upper)
    t, zero, work = np.empty(m), np.zeros(m), np.empty(workspace_shape(*first.W.shape))
    W, w = np.array([p.W for p in problems]), np.array([p.wrench for p in problems])
    yield from ratios({
        "exact QP, one call": per_item(
            loads, lambda p: nearest_tensions(*p, lower, upper, zero, t)
        ),
        "closed form, one call": per_item(
            loads, lambda p: closed_form(work, *p, lower, upper, zero, zero, t)
        ),
        "exact QP, batch on one core": per_call(
            lambda: distribute_batch(W, w, lower, upper, threads=1), 5, COUNT
        ),
        "distribute(), with checks": per_item(problems, distribute),
        "Distributor, new W and wrench": per_item(loads, lambda p: loop(*p)),
        "daqp, model updated": per_item(loads, lambda p: solver.solve(*p)),
    })  # fmt: skip
    yield from method_ratios(problems[:FEW])
    yield from program_ratios()


def random_problems() -> list[TensionProblem]:
    """Feasible problems of one robot at seeded poses inside its workspace."""
    robot, random = load_robot(ROBOT), np.random.default_rng(0)
    problems: list[TensionProblem] = []
    while len(problems) < COUNT:
        position = random.uniform([-0.35, -0.35, 0.1], [0.35, 0.35, 0.8])
        X_WP = pose_from_angles(position, random.uniform(-0.2, 0.2, 3))
        problem = tension_problem(robot, X_WP, cables=robot.cable_set(pulleys=False))
        if distribute(problem).status == "feasible":
            problems.append(problem)
    return problems


def _arrays(problems: list[TensionProblem]) -> list[tuple[Array, Array]]:
    """W and wrench of each problem, writable as in a loop: kernels take no others."""
    return [(writable(p.W), writable(p.wrench)) for p in problems]


def method_ratios(problems: list[TensionProblem]) -> list[Ratio]:
    """Every method by `distribute`, checks included, and Drake's solvers beside them."""
    base = "quadratic_program"
    names = [name for name, method in METHODS.items() if method.takes(2)]
    ways: dict[str, Callable[[], float]] = {
        f"distribute(), {name}": per_item(problems, partial(distribute, method=name))
        for name in names
        if name not in ("reference_program", base)
    }
    for kind in (OsqpSolver, ClarabelSolver):
        solver = kind().id()
        ways[f"MathematicalProgram, {solver.name()}"] = per_item(
            problems, lambda p, solver=solver: program_tensions(p, base, solver)
        )
    return ratios({**ways, f"distribute(), {base}": per_item(problems, distribute)}, 5)


def quadratic(problem: TensionProblem) -> TensionProgram:
    """Tensions near 8 N, a pair of cables within 1 N."""
    program = TensionProgram(problem)
    program.AddQuadraticCost(8.0, 2.0)
    program.AddLinearConstraint([1.0, -1.0], -1.0, 1.0, of=["cable 1", "cable 2"])
    return program


def nonlinear(problem: TensionProblem) -> TensionProgram:
    """A barrier at no tension, a function in Python."""
    program = TensionProgram(problem)
    program.AddCost(lambda t: 20.0 * float(np.sum(1.0 / t)))
    return program


def program_ratios() -> Iterator[Ratio]:
    """A step of methods made of programs, from the tensions of the step before."""
    robot, turns = load_robot(ROBOT), np.linspace(0.0, 2.0 * np.pi, STEPS)
    places = np.column_stack([0.2 * np.cos(turns), 0.2 * np.sin(turns), np.full(STEPS, 0.35)])
    poses = [pose_from_angles(place, np.zeros(3)) for place in places]
    cables, limits = robot.cable_set(pulleys=False), (1.0, 60.0)
    problems = [tension_problem(robot, X_WP, limits=limits, cables=cables) for X_WP in poses]
    kernel, loads = Distributor(problems[0]), _arrays(problems)
    for build in (quadratic, nonlinear):
        method = TensionMethod.from_program(build.__name__, build)
        steps = partial(_follow, Distributor(problems[0], build.__name__), loads)
        steps()
        assert method.step_times is not None
        method.step_times.restart()
        yield from ratios({
            f"{build.__name__} program, a step": per_call(steps, parts=STEPS),
            "Distributor, quadratic_program": per_item(loads, lambda p: kernel(*p)),
        }, 3)  # fmt: skip
        print(f"    {method.step_times.words()}")


def _follow(distributor: Distributor, loads: list[tuple[Array, Array]]) -> None:
    tensions = None
    for W, wrench in loads:
        tensions = distributor(W, wrench, tensions).tensions
