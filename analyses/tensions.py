"""Cable tensions that hold a robot's platform, or a mechanism, at rest."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from cdpr_drake.analyses.frame.result import Result, Table
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import (
    OF_MECHANISMS,
    OF_ROBOTS,
    Joints,
    Limits,
    ModelWord,
    PoseWord,
    SomeNames,
    Vector,
    Wrench,
    one_of,
    refuse_arguments,
)
from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.models.robot_loader import as_robot, names_mechanism
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import as_pose, as_wrench, wrench_balance
from cdpr_drake.summaries import numbers
from cdpr_drake.tensions.methods import (
    METHODS,
    TensionMethod,
    distribute,
    feasible_polygon,
    solution_space,
)
from cdpr_drake.tensions.problem import TensionProblem, TensionSolution, TensionStatus

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cdpr_drake.models.mechanism_schema import Mechanism
    from cdpr_drake.statics.controlled_wrenches import WrenchControl
    from cdpr_drake.tensions.shortfall import Shortfall

TENSION_METHODS: Mapping[str, TensionMethod] = METHODS
"""Methods of `solve_tensions` and `distribute` by name; a new one is a row of
`tensions.methods.METHODS`."""

ALL = "all"
"""In the place of a method: each that applies."""

UNDERACTUATED = "quadratic_program"
"""The only method where cables do not control all that has to be balanced."""


@dataclass(frozen=True, eq=False, repr=False)
class Tensions(Result):
    """Tensions at a pose, by one method or by all, and the verdict on them.

    Attributes:
        subject: The robot or mechanism.
        place: Its name and where it is, for titles.
        geometry: Geometry of the cables, as `CableSet.geometry_words`.
        cables: Their names, m of them.
        rows: What has to be balanced, in words, n of them.
        wrench: How much of each, shape (n,) [N m, N].
        bounds: Smallest and largest tensions, shape (m,) each [N].
        problem: What the methods solve; None where the cables do not control every row.
        solutions: The answer of each method.
        control: Where the cables do not control every row: what they can do; else None.
    """

    subject: Robot | Mechanism
    place: str
    geometry: str
    cables: tuple[str, ...]
    rows: tuple[str, ...]
    wrench: Array
    bounds: tuple[Array, Array]
    problem: TensionProblem | None = None
    solutions: tuple[TensionSolution, ...] = ()
    control: WrenchControl | None = None

    @property
    def solution(self) -> TensionSolution:
        """The answer of the first method.

        Raises:
            TensionProblemError: The cables do not control every row.
        """
        if not self.solutions:
            raise TensionProblemError(f"{self.place}: found cables that do not control every row")
        return self.solutions[0]

    @property
    def tensions(self) -> Array:
        """Of the first method, shape (m,) [N]; NaN where there are none."""
        if self.control is None:
            return self.solution.tensions
        none = self.control.tensions is None
        return np.full(len(self.cables), np.nan) if none else np.asarray(self.control.tensions)

    @property
    def status(self) -> str:
        """The verdict on these: feasible, infeasible or missed."""
        if self.control is None:
            return str(self.solution.status)
        none = self.control.tensions is None
        return str(TensionStatus.INFEASIBLE if none else TensionStatus.FEASIBLE)

    @cached_property
    def shortfall(self) -> Shortfall | None:
        """By how much tensions miss the wrench; None where some balance it."""
        if self.control is not None:
            return self.control.shortfall()
        none = any(each.status == TensionStatus.INFEASIBLE for each in self.solutions)
        if self.problem is None or not none:
            return None
        from cdpr_drake.tensions.shortfall import shortfall

        return shortfall(self.problem)

    def uncontrolled(self) -> list[dict[str, Any]]:
        """For each twist that changes no length: the combination of the wrench that no tensions
        change, its components, and what of it nothing balances [N, or N m with moments]."""
        from cdpr_drake.statics.controlled_wrenches import combination_words

        if self.control is None:
            return []
        return [
            {"combination": combination_words(twist, self.rows),
             "components": dict(zip(self.rows, twist.tolist(), strict=True)),
             "unbalanced": float(off)}
            for twist, off in zip(self.control.free.T, self.control.unbalanced, strict=True)
        ]  # fmt: skip

    def as_dict(self) -> dict[str, Any]:
        """For JSON; with two cables more than needed also the corners of the feasible polygon."""
        of_robot = isinstance(self.subject, Robot)
        result: dict[str, Any] = {
            "robot" if of_robot else "mechanism": self.subject.name, "geometry": self.geometry,
            "redundancy": len(self.cables) - len(self.rows), "rows": list(self.rows),
            "infeasible_by": None
            if self.shortfall is None
            else self.shortfall.as_dict(list(self.cables)),
        }  # fmt: skip
        result |= {"wrench_n_m_n": self.wrench.tolist()} if of_robot else {
            "cables": list(self.cables)
        }  # fmt: skip
        if self.control is None:
            solutions = [solution.as_dict() for solution in self.solutions]
            single = of_robot and len(solutions) == 1
            result |= solutions[0] if single else {"solutions": solutions}
            if of_robot and self.problem is not None and self.problem.redundancy == 2:
                result["polygon_vertices_n"] = polygon_tensions(self.problem)
            return result
        missing = self.control.tensions is None
        uncontrolled = self.uncontrolled()
        if not of_robot:
            uncontrolled = [{key: row[key] for key in ("combination", "unbalanced")}
                            for row in uncontrolled]  # fmt: skip
        result |= {
            "method": UNDERACTUATED, "rank": self.control.rank, "status": self.status,
            "tensions_n": None if missing else self.tensions.tolist(),
            "uncontrolled": uncontrolled,
        }  # fmt: skip
        return result | ({"degrees_of_freedom": len(self.rows)} if of_robot else {})

    def tables(self) -> list[Table]:
        """Tensions by method and cable."""
        title = f"{self.place}: tensions [N], {self.geometry}"
        answers = {each.method: (str(each.status), each.tensions) for each in self.solutions}
        answers = answers or {UNDERACTUATED: (self.status, self.tensions)}
        return [Table(title, ("method", "status", *self.cables), [
            (method, status, *(f"{t:.2f}" if np.isfinite(t) else "-" for t in tensions))
            for method, (status, tensions) in answers.items()
        ])]  # fmt: skip

    def lines(self) -> list[str]:
        """What has to be balanced, what no tensions change, and what they miss."""
        load = ", ".join(
            f"{name} {value:.4g}"
            for name, value in zip(self.rows, self.wrench, strict=True) if value != 0.0
        )  # fmt: skip
        result = [f"to balance [N m, N]: {load or 'nothing'}"]
        if self.control is not None:
            result.append(
                f"{len(self.cables)} cables control {self.control.rank} of {len(self.rows)} rows; "
                "no tensions change these, all of which are zero at rest:"
            )
            result += [f"  {row['combination']}: {row['unbalanced']:.4g}"
                       for row in self.uncontrolled()]  # fmt: skip
        if self.shortfall is not None:
            rows = self.shortfall.rows(list(self.cables), self.rows)
            result += [f"{label}: {words}" for label, words in rows]
        return result

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """The feasible polygon of two redundant cables, tensions with their bounds, and sections of
        the wrenches that the cables can give."""
        result = {"tensions": self._draw_tensions}
        if self.problem is not None:
            result["wrenches"] = self._draw_wrenches
            if self.problem.redundancy == 2 and feasible_polygon(self.problem).shape[1]:
                result = {"polygon": self._draw_polygon, **result}
        return result

    def _draw_tensions(self) -> Figure:
        from cdpr_drake.analyses.tension_figures import tension_figure

        by_method = {each.method: each.tensions for each in self.solutions}
        by_method = by_method or {UNDERACTUATED: self.tensions}
        return tension_figure(self.cables, by_method, self.bounds, self._title())

    def _draw_polygon(self) -> Figure:
        from cdpr_drake.analyses.tension_figures import polygon_figure

        assert self.problem is not None
        return polygon_figure(self.problem, self.solutions, self._title())

    def _draw_wrenches(self) -> Figure:
        from cdpr_drake.analyses.workspaces.workspace_figures import wrench_set_figure
        from cdpr_drake.workspaces.available_wrenches import available_wrenches

        assert self.problem is not None
        problem = self.problem
        wrenches = available_wrenches(problem.W, problem.lower, problem.upper, problem.row_scale)
        return wrench_set_figure(
            wrenches, -problem.wrench, f"{self._title()}: what the cables can give"
        )

    def _title(self) -> str:
        return f"{self.place}, {self.geometry}"


def applicable_methods(problem: TensionProblem) -> list[str]:
    """Names of the methods that take this redundancy, and a reference if they need one."""
    return [
        name for name, method in TENSION_METHODS.items() if method.takes(problem.redundancy)
        and (problem.reference is not None or not method.needs_reference)
    ]  # fmt: skip


def polygon_tensions(problem: TensionProblem) -> list[list[float]]:
    """Tensions at the corners of the feasible polygon, one list of m [N] per corner."""
    t, N = solution_space(problem)
    return (t[:, np.newaxis] + N @ feasible_polygon(problem)).T.tolist()


@verb()
def solve_tensions(
    robot: ModelWord, pose: PoseWord = None, wrench: Wrench = None,
    method: Annotated[str, one_of((*TENSION_METHODS, ALL))] = "quadratic_program", *,
    force: Vector = None, moment: Vector = None, pulleys: bool = True, limits: Limits = None,
    mass: float | None = None, reference: float | None = None, length_scale: float | None = None,
    joints: Joints = None, held: SomeNames = None,
) -> Tensions:  # fmt: skip
    """Finds cable tensions that hold the platform at a pose, or proves that there are none.

    W t + w = 0 with lower <= t <= upper; w is the weight plus the wrench. Of a mechanism
    W = -J_l' on the rows that no motor holds, with the length Jacobian J_l, and w is the
    generalized force of gravity and of its springs.

    If the cables do not control all of w, as fewer cables than degrees of freedom, the answer says
    which combinations no tensions change. Every answer has exit code 0, also `infeasible` and
    `missed`: `status` says which.

    Args:
        robot: Robot or mechanism by name or file.
        pose: Pose X_WP of the platform [m, deg]; default: its home.
        wrench: Wrench on the platform about Po in W, beside its weight, moments first [N m, N].
        method: Tension distribution method, or all.
        force: Instead of a wrench: force on the platform in Po, in W [N].
        moment: Instead of a wrench: moment on the platform in W [N m].
        pulleys: Take the robot's pulleys into account; without them cables run from fixed exit
            points.
        limits: Smallest and largest tension [N]; default: the robot's.
        mass: Mass of the platform [kg]; default: the robot's.
        reference: Desired tension of all cables [N], for reference_program; in Python also shape
            (m,).
        length_scale: Length by which slack_relaxed and log_barrier divide moments [m]; default:
            root mean square distance of the anchor points from Po.
        joints: Of a mechanism: position of a joint [rad, m], may be repeated; default: its home.
        held: Of a mechanism: joints that motors hold; default: those with actuators.

    Raises:
        TensionProblemError: The pose is outside the frame, or a number, the method or an argument
            of the other kind is not accepted.
        EquilibriumError: The mechanism has no such joint.

    Source: servoing thesis 1.2.2, (1.27); Gazebo thesis 6.2.
    """
    if names_mechanism(robot):
        refuse_arguments(OF_ROBOTS, pose=pose, wrench=wrench, force=force, moment=moment, mass=mass)
        return _of_mechanism(
            robot, method, dict(joints or {}), held, pulleys, limits, reference, length_scale
        )
    refuse_arguments(OF_MECHANISMS, joints=joints, held=held)
    loaded = as_robot(robot, "solve_tensions")
    X_WP, load = as_pose(loaded, pose), as_wrench(wrench, force, moment)
    balance = wrench_balance(
        loaded, X_WP, load, limits=limits, mass=mass, length_scale=length_scale,
        cables=loaded.cable_set(pulleys),
    )  # fmt: skip
    answer: dict[str, Any] = {
        "subject": loaded, "place": f"{loaded.name} at ({numbers(X_WP.translation())}) m",
        "geometry": loaded.geometry_words(pulleys),
        "cables": tuple(cable.name for cable in loaded.cables),
        "rows": tuple(loaded.motion_type().words()), "wrench": balance.wrench,
        "bounds": (balance.lower, balance.upper),
    }  # fmt: skip
    if loaded.is_underactuated():
        if method not in (UNDERACTUATED, ALL):
            raise TensionProblemError(
                f"method: found {method} for fewer cables than degrees of freedom of "
                f"{loaded.name}; accepted: {UNDERACTUATED}"
            )
        return Tensions(**answer, control=balance.control())
    problem = TensionProblem(
        balance.W, balance.wrench, balance.lower, balance.upper,
        _desired(reference, len(loaded.cables)), balance.row_scale,
    )  # fmt: skip
    return Tensions(**answer, problem=problem, solutions=_solutions(problem, method))


def _of_mechanism(
    robot: Any, method: str, joints: Mapping[str, Any], held: Sequence[str] | None, pulleys: bool,
    limits: tuple[float, float] | None, reference: Any, length_scale: float | None,
) -> Tensions:  # fmt: skip
    from cdpr_drake.analyses.mechanisms import place_mechanism
    from cdpr_drake.statics.controlled_wrenches import wrench_control
    from cdpr_drake.tensions.quadratic_program_kernel import RANK_TOLERANCE

    placed = place_mechanism(robot, joints, pulleys=pulleys)
    words, turns = placed.rows()
    rows = np.flatnonzero(~placed.held_rows(held))
    if not len(rows):
        raise TensionProblemError(
            "held: found all joints held by motors; accepted: some that cables hold"
        )
    W = -placed.cables.length_jacobian(placed.context).T[rows]
    wrench, m = placed.cables.other_forces(placed.context)[rows], placed.cables.routes.count
    lower, upper = (np.full(m, limit) for limit in placed.mechanism.tension_limits(limits))
    scale = _row_scale(W, turns[rows], length_scale)
    answer: dict[str, Any] = {
        "subject": placed.mechanism, "place": placed.mechanism.name, "geometry": placed.geometry,
        "cables": placed.cables.routes.names, "rows": tuple(words[row] for row in rows),
        "wrench": wrench, "bounds": (lower, upper),
    }  # fmt: skip
    singular = np.linalg.svd(W, compute_uv=False)
    if len(rows) > m or int(np.sum(singular > RANK_TOLERANCE * singular[0])) < len(rows):
        if method not in (UNDERACTUATED, ALL):
            raise TensionProblemError(
                f"method: found {method} where cables do not control every row of "
                f"{placed.mechanism.name}; accepted: {UNDERACTUATED}"
            )
        return Tensions(**answer, control=wrench_control(W, wrench, lower, upper, scale))
    problem = TensionProblem(W, wrench, lower, upper, _desired(reference, m), scale)
    return Tensions(**answer, problem=problem, solutions=_solutions(problem, method))


def _solutions(problem: TensionProblem, method: str) -> tuple[TensionSolution, ...]:
    methods = applicable_methods(problem) if method == ALL else [method]
    return tuple(distribute(problem, name) for name in methods)


def _desired(reference: Any, m: int) -> Array | None:
    """Desired tensions, shape (m,) [N], of one for all cables."""
    if reference is None or np.ndim(reference) > 0:
        return None if reference is None else np.asarray(reference, float)
    return np.full(m, float(reference))


def _row_scale(W: Array, turns: Array, length_scale: float | None) -> Array:
    """What makes moments and forces comparable, shape (n,) [m, -]."""
    if length_scale is None:
        arms = W[turns][W[turns] != 0.0]
        length_scale = float(np.sqrt(np.mean(arms**2))) if len(arms) else 1.0
    if not (np.isfinite(length_scale) and length_scale > 0.0):
        raise TensionProblemError(f"length_scale: found {length_scale:g}; accepted: above 0 [m]")
    return np.where(turns, length_scale, 1.0)
