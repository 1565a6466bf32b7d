"""Tensions that hold a robot's platform at a pose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.statics.tension_query import (
    polygon_tensions,
    solve_all,
    underactuated_answer,
)
from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import (
    WrenchBalance,
    as_pose,
    as_wrench,
    tension_problem,
    wrench_balance,
)
from cdpr_drake.summaries import Summarized, numbers
from cdpr_drake.tensions.methods import METHODS, TensionMethod, distribute, feasible_polygon
from cdpr_drake.tensions.problem import TensionProblem, TensionSolution, TensionStatus
from cdpr_drake.tensions.shortfall import Shortfall, shortfall

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TENSION_METHODS: Mapping[str, TensionMethod] = METHODS
"""The methods of `solve_tensions` and `distribute` by name; `tensions.METHODS`, where a new one is
a row."""

UNDERACTUATED = "quadratic_program"
"""The only method for fewer cables than degrees of freedom."""


@dataclass(frozen=True, eq=False, repr=False)
class TensionsAtPose(Summarized):
    """Tensions of a robot at a pose, by one method or by several.

    Attributes:
        robot: The robot.
        X_WP: Pose of the platform [m].
        problem: What was asked.
        solutions: The answer of each method that was asked.
        pulleys: False if the robot's pulleys were ignored.
    """

    robot: Robot
    X_WP: RigidTransform
    problem: TensionProblem
    solutions: tuple[TensionSolution, ...]
    pulleys: bool = True

    @property
    def geometry(self) -> str:
        """Geometry of the cables in words, as `Robot.geometry_words`."""
        return self.robot.geometry_words(self.pulleys)

    @cached_property
    def shortfall(self) -> Shortfall | None:
        """By how much tensions miss the wrench; None where there are some that balance it."""
        none = any(one.status == TensionStatus.INFEASIBLE for one in self.solutions)
        return shortfall(self.problem) if none else None

    def _cables(self) -> list[str]:
        return [cable.name for cable in self.robot.cables]

    def shortfall_rows(self) -> list[tuple[str, str]]:
        """`shortfall` in words; empty where there is none."""
        if self.shortfall is None:
            return []
        return self.shortfall.rows(self._cables(), self.robot.motion_type().words())

    def numbers(self) -> dict[str, Any]:
        """The answers alone for JSON."""
        return {"solutions": [solution.as_dict() for solution in self.solutions]}

    def as_dict(self) -> dict[str, Any]:
        """For JSON; with two cables more than needed also the corners of the feasible polygon."""
        found = {
            "robot": self.robot.name, "geometry": self.geometry,
            "redundancy": self.problem.redundancy, **self.numbers(),
            "rows": list(self.robot.motion_type().words()),
            "wrench_n_m_n": self.problem.wrench.tolist(),
            "infeasible_by": None
            if self.shortfall is None
            else self.shortfall.as_dict(self._cables()),
        }  # fmt: skip
        if self.problem.redundancy == 2:
            found["polygon_vertices_n"] = polygon_tensions(self.problem)
        return found

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself: each method with its tensions [N]."""
        title = f"Tensions of {self.robot.name} at ({numbers(self.X_WP.translation())}) m [N]"
        return title, [("geometry", self.geometry)] + [
            (one.method, f"{one.status}: {numbers(one.tensions)}") for one in self.solutions
        ] + self.shortfall_rows()

    def plot(self) -> Figure:
        """With two cables more than needed and a feasible polygon that with a point for each
        method, else tensions with their bounds.
        """
        asked = self.problem
        if asked.redundancy == 2 and feasible_polygon(asked).shape[1]:
            return self.plot_polygon()
        from cdpr_drake.analyses.statics.static_figures import tension_figure

        found = {one.method: one.tensions for one in self.solutions}
        return tension_figure(self._cables(), found, (asked.lower, asked.upper), self._where())

    def plot_polygon(self) -> Figure:
        """The feasible polygon with a point for each method that was asked.

        Raises:
            TensionProblemError: There are not two cables more than needed, or no tensions at all.
        """
        from cdpr_drake.analyses.statics.static_figures import polygon_figure

        return polygon_figure(self.problem, self.solutions, self._where())

    def plot_wrenches(self) -> Figure:
        """Sections of the wrenches that the cables can give at the pose."""
        from cdpr_drake.analyses.workspaces.workspace_figures import wrench_set_figure
        from cdpr_drake.workspaces.available_wrenches import available_wrenches

        asked = self.problem
        found = available_wrenches(asked.W, asked.lower, asked.upper, asked.row_scale)
        title = f"{self._where()}: what the cables can give"
        return wrench_set_figure(found, -asked.wrench, title)

    def _where(self) -> str:
        return f"{self.robot.name} at ({numbers(self.X_WP.translation())}) m, {self.geometry}"


@dataclass(frozen=True, eq=False, repr=False)
class RobotTensions(TensionsAtPose):
    """Tensions of a robot at a pose by one method: a solution, and what it is the solution of."""

    @property
    def solution(self) -> TensionSolution:
        """The answer."""
        return self.solutions[0]

    @property
    def tensions(self) -> Array:
        """Shape (m,) [N], see `TensionSolution`."""
        return self.solution.tensions

    @property
    def status(self) -> str:
        """The verdict: feasible, infeasible or missed."""
        return str(self.solution.status)

    @property
    def residual(self) -> float:
        """What is left unbalanced, relative to the forces at work [-]."""
        return self.solution.residual

    def numbers(self) -> dict[str, Any]:
        """The answer alone for JSON."""
        return self.solution.as_dict()

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself; tensions on a bound have a star."""
        title, rows = self.solution.summary()
        low, high = self.problem.lower[0], self.problem.upper[0]
        rows += [("bounds", f"{low:g} to {high:g} N"), *self.shortfall_rows()]
        return f"{self._where()}: {title.lower()}", rows


@dataclass(frozen=True, eq=False, repr=False)
class UnderactuatedTensions(Summarized):
    """What fewer cables than degrees of freedom can do at a pose.

    Attributes:
        robot: The robot.
        X_WP: Pose of the platform [m].
        balance: What was asked.
        pulleys: False if the robot's pulleys were ignored.
    """

    robot: Robot
    X_WP: RigidTransform
    balance: WrenchBalance
    pulleys: bool = True

    @property
    def geometry(self) -> str:
        """Geometry of the cables in words, as `Robot.geometry_words`."""
        return self.robot.geometry_words(self.pulleys)

    @cached_property
    def _answer(self) -> dict[str, Any]:
        return underactuated_answer(self.robot, self.balance) | {"geometry": self.geometry}

    def shortfall_rows(self) -> list[tuple[str, str]]:
        """How far tensions miss what the cables control, in words; empty where some balance it."""
        short = self.balance.control().shortfall()
        cables = [cable.name for cable in self.robot.cables]
        return [] if short is None else short.rows(cables, self.robot.motion_type().words())

    @property
    def status(self) -> str:
        """The verdict: feasible, where nothing is left unbalanced, or infeasible."""
        return str(self._answer["status"])

    @property
    def tensions(self) -> Array:
        """Shape (m,) [N]; NaN where none hold the platform."""
        found = self._answer["tensions_n"]
        return np.full(len(self.robot.cables), np.nan) if found is None else np.array(found)

    def as_dict(self) -> dict[str, Any]:
        """For JSON, see `underactuated_answer`."""
        return self._answer

    def plot(self) -> Figure:
        """Tensions that hold the platform, where there are some, with the robot's bounds."""
        from cdpr_drake.analyses.statics.static_figures import tension_figure

        names = [cable.name for cable in self.robot.cables]
        lower, upper = self.robot.tension_limits()
        bounds = np.full(len(names), lower), np.full(len(names), upper)
        place = f"({numbers(self.X_WP.translation())}) m"
        title = f"{self.robot.name} at {place}, {self.geometry}: {self.status}"
        return tension_figure(names, {UNDERACTUATED: self.tensions}, bounds, title)

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself: combinations of the wrench that no tensions change."""
        answer = self._answer
        title = (
            f"{answer['robot']}: {len(self.robot.cables)} cables for "
            f"{answer['degrees_of_freedom']} degrees of freedom: {answer['status']}"
        )
        rows = [
            (
                "not controlled",
                f"{one['combination']}, {abs(one['unbalanced']):.3g} unbalanced",
            )
            for one in answer["uncontrolled"]
        ]
        rows += self.shortfall_rows()
        return title, [
            ("geometry", self.geometry), ("tensions [N]", numbers(self.tensions)), *rows,
        ]  # fmt: skip


@verb()
def solve_tensions(
    robot: Robot | str | Path,
    pose: object = None,
    wrench: Sequence[float] | Array | None = None,
    method: str = "quadratic_program",
    *,
    force: Sequence[float] | Array | None = None,
    moment: Sequence[float] | Array | None = None,
    pulleys: bool = True,
    limits: tuple[float, float] | None = None,
    mass: float | None = None,
    reference: Array | float | None = None,
    length_scale: float | None = None,
) -> RobotTensions | UnderactuatedTensions:
    """Tensions that hold the platform at rest at a pose, or a proof that there are none.

    W t + w = 0 with lower <= t <= upper, w the weight and the wrench that is given.

    Args:
        robot: The robot, or its name or path.
        pose: X_WP as `as_pose` takes it [m]; None: the home pose.
        wrench: Wrench on the platform about Po in W, in addition to its weight, moments first:
            (m_x, m_y, m_z, f_x, f_y, f_z), shape (6,) [N m, N].
        method: A name of `TENSION_METHODS`.
        force: Instead of `wrench`: force on the platform in Po, in W, shape (3,) [N].
        moment: Instead of `wrench`: moment on the platform in W, shape (3,) [N m].
        pulleys: True: cables run over the robot's pulleys. False: pulleys are ignored, and cables
            run from fixed exit points.
        limits: Smallest and largest tension [N]; None: the robot's.
        mass: Mass of the platform [kg]; None: the robot's.
        reference: Desired tensions, one for all cables or shape (m,) [N], for reference_program.
        length_scale: By which methods that relax divide moments [m]; None: the anchor points'
            root mean square distance from Po.

    Returns:
        The tensions and the verdict on them; if there are none, by how much they miss the wrench;
        with fewer cables than degrees of freedom also what no tensions change.

    Raises:
        TensionProblemError: The pose is outside the frame, or a number or the method is not
            accepted.

    Source: servoing thesis 1.2.2, (1.27); Gazebo thesis 6.2.
    """
    loaded, X_WP = _at(robot, pose)
    wrench, cables = as_wrench(wrench, force, moment), loaded.cable_set(pulleys)
    if loaded.is_underactuated():
        if method != UNDERACTUATED:
            raise TensionProblemError(
                f"method: found {method} for fewer cables than degrees of freedom of "
                f"{loaded.name}; accepted: {UNDERACTUATED}"
            )
        balance = wrench_balance(
            loaded, X_WP, wrench, limits=limits, mass=mass, length_scale=length_scale,
            cables=cables,
        )  # fmt: skip
        return UnderactuatedTensions(loaded, X_WP, balance, pulleys)
    problem = tension_problem(
        loaded, X_WP, wrench, limits=limits, mass=mass, reference=_wanted(loaded, reference),
        length_scale=length_scale, cables=cables,
    )  # fmt: skip
    return RobotTensions(loaded, X_WP, problem, (distribute(problem, method),), pulleys)


@verb()
def compare_tensions(
    robot: Robot | str | Path,
    pose: object = None,
    wrench: Sequence[float] | Array | None = None,
    *,
    force: Sequence[float] | Array | None = None,
    moment: Sequence[float] | Array | None = None,
    pulleys: bool = True,
    limits: tuple[float, float] | None = None,
    mass: float | None = None,
    reference: Array | float | None = None,
    length_scale: float | None = None,
) -> TensionsAtPose:
    """The tensions of every method that the robot can be asked for; arguments as `solve_tensions`.

    Raises:
        TensionProblemError: As `solve_tensions`, or there are fewer cables than degrees of freedom.
    """
    loaded, X_WP = _at(robot, pose)
    problem = tension_problem(
        loaded, X_WP, as_wrench(wrench, force, moment), limits=limits, mass=mass,
        reference=_wanted(loaded, reference), length_scale=length_scale,
        cables=loaded.cable_set(pulleys),
    )  # fmt: skip
    return TensionsAtPose(loaded, X_WP, problem, tuple(solve_all(problem)), pulleys)


def _at(robot: Robot | str | Path, pose: object) -> tuple[Robot, RigidTransform]:
    loaded = as_robot(robot, "solve_tensions")
    return loaded, as_pose(loaded, pose)


def _wanted(robot: Robot, reference: Array | float | None) -> Array | None:
    """Wanted tensions, one for each cable."""
    if reference is None or np.ndim(reference) > 0:
        return None if reference is None else np.asarray(reference)
    return np.full(len(robot.cables), reference)
