"""A robot at rest: at a pose, with given lengths, all its poses of rest; poses from lengths."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.statics.equilibria_query import (
    SHOWN,
    EquilibriaReport,
    elastic_equilibria,
    equilibria_at_lengths,
    equilibria_with_position,
)
from cdpr_drake.analyses.statics.static_query import StaticReport, static_at_lengths, static_at_pose
from cdpr_drake.arrays import Array
from cdpr_drake.cables.models import CABLE_MODELS, ELASTIC
from cdpr_drake.errors import EquilibriumError, TensionProblemError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import angles_from_rotation
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import as_pose, check_pose
from cdpr_drake.schema.typed_yaml import closest
from cdpr_drake.statics.forward_kinematics import ForwardKinematics, PoseFit
from cdpr_drake.summaries import Summarized, Tabulated, as_kind, numbers

if TYPE_CHECKING:
    from matplotlib.figure import Figure

EQUILIBRIA_MODELS = ("inextensible", "elastic")
"""Cable models of `find_equilibria`."""

DOUBTFUL = 0.005
"""Share of the mean length beyond which a residual is remarked: cables and drums of a machine that
is measured are off by less."""


class RobotAtRest(StaticReport):
    """A `StaticReport` that draws itself."""

    def plot(self) -> Figure:
        """The robot with its tensions, sags and natural frequencies."""
        from cdpr_drake.analyses.statics.static_figures import static_figure

        return static_figure(self, f"{self.robot} at rest, {self.model} cables, {self.geometry}")

    def plot_behaviour(self, robot: Robot | str | Path) -> Figure:
        """What the robot's file says that cables and contacts do: force over elongation, tensions
        at the drums, moments of contacts.

        Args:
            robot: The robot that is at rest, or its name or path.

        Raises:
            CableModelError: Its file says nothing of them.
        """
        from cdpr_drake.analyses.statics.behaviour_figures import behaviour_figure

        return behaviour_figure(as_robot(robot, "plot_behaviour"), self)


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class RobotEquilibria(EquilibriaReport):
    """An `EquilibriaReport` that draws itself.

    Attributes:
        loaded: The robot.
    """

    loaded: Robot

    def plot(self) -> Figure:
        """The robot at its poses of rest, the `SHOWN` lowest; slack cables are dotted."""
        from cdpr_drake.analyses.visualization.path_figures import poses_figure

        some = self.rests[:SHOWN]
        poses = {f"{k + 1}: {one.stability}": one.X_WP for k, one in enumerate(some)}
        what = f"{len(self.rests)} poses of rest, {self.model} cables, {self.geometry}"
        title = f"{self.robot}: {what}"
        slack = [np.asarray(one.tensions) <= 0.0 for one in some]
        return poses_figure(title, self.loaded, poses, slack)


@dataclass(frozen=True, eq=False, repr=False)
class PoseFromLengths(Summarized):
    """The pose of a robot's platform that has given cable lengths.

    Attributes:
        robot: The robot.
        lengths: What was given, shape (m,) [m].
        fit: The pose with its residuals, Jacobian, `covariance` and `condition`.
        geometry: Geometry of the cables, as `Robot.geometry_words`.
    """

    robot: Robot
    lengths: Array
    fit: PoseFit
    geometry: str

    @property
    def X_WP(self) -> RigidTransform:
        """The pose [m]."""
        return self.fit.X_WP

    @property
    def residuals(self) -> Array:
        """Lengths at the pose less those given, shape (m,) [m]."""
        return self.fit.residuals

    def deviations(self) -> tuple[float, float] | None:
        """Standard deviations of the position [m] and of the rotation [rad], root sums of squares
        over the axes, from the scatter of the lengths; None without redundant cables."""
        scatter = self.fit.scatter()
        if scatter is None:
            return None
        variances, turns = np.diag(self.fit.covariance(scatter)), self.fit.turns
        return float(np.sqrt(variances[turns:].sum())), float(np.sqrt(variances[:turns].sum()))

    def as_dict(self) -> dict[str, Any]:
        """For JSON; keys end in units."""
        deviations = self.deviations()
        return {
            "robot": self.robot.name,
            "geometry": self.geometry,
            "lengths_m": self.lengths.tolist(),
            "position_m": self.X_WP.translation().tolist(),
            "angles_deg": np.degrees(angles_from_rotation(self.X_WP.rotation())).tolist(),
            "residuals_m": self.residuals.tolist(),
            "length_scatter_m": self.fit.scatter(),
            "position_deviation_m": None if deviations is None else deviations[0],
            "rotation_deviation_deg": None if deviations is None else np.degrees(deviations[1]),
            "steps": self.fit.steps,
            "remarks": self.remarks(),
        }

    def remarks(self) -> list[str]:
        """What speaks against the lengths or the pose; empty for nothing."""
        found, worst = [], int(np.argmax(np.abs(self.residuals)))
        residual = abs(float(self.residuals[worst]))
        if residual > DOUBTFUL * float(np.mean(self.lengths)):
            found.append(
                f"the lengths belong to no pose: the best fit misses that of "
                f"{self.robot.cables[worst].name} by {1e3 * residual:.3g} mm"
            )
        try:
            check_pose(self.robot, self.X_WP)
        except TensionProblemError as problem:
            found.append(str(problem).removeprefix("pose: found "))
        return found

    def plot(self) -> Figure:
        """The robot at the pose."""
        from cdpr_drake.analyses.visualization.path_figures import poses_figure

        title = f"{self.robot.name}: pose from cable lengths, {self.geometry}"
        return poses_figure(title, self.robot, {"platform": self.X_WP})

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself."""
        angles = np.degrees(angles_from_rotation(self.X_WP.rotation()))
        worst = float(np.max(np.abs(self.residuals)))
        rows = [
            ("geometry", self.geometry),
            ("position [m]", numbers(self.X_WP.translation(), 5)),
            ("angles [deg]", numbers(angles)),
            ("residuals", f"at most {1e3 * worst:.2g} mm, in {self.fit.steps} steps"),
        ]
        deviations = self.deviations()
        if deviations is not None:
            distance, angle = 1e3 * deviations[0], np.degrees(deviations[1])
            rows.append(("standard deviation", f"{distance:.2g} mm, {angle:.2g} deg"))
        rows += [("remark", words) for words in self.remarks()]
        return f"Pose of {self.robot.name} from its cable lengths", rows


@dataclass(frozen=True, eq=False, repr=False)
class CableLengths(Tabulated):
    """Lengths and directions of a robot's cables at a pose.

    Attributes:
        robot: The robot.
        X_WP: The pose [m].
        geometry: Geometry of the cables, as `Robot.geometry_words`.
        lengths: From A along the groove of the pulley and straight to B, shape (m,) [m].
        directions: Unit vectors u in W along the free parts, from where a cable leaves its pulley,
            A without one, to B, shape (3, m) [-]. A tension t pulls the platform with -t u.
    """

    robot: Robot
    X_WP: RigidTransform
    geometry: str
    lengths: Array
    directions: Array

    def as_dict(self) -> dict[str, Any]:
        """For JSON; keys end in units."""
        return {
            "robot": self.robot.name,
            "position_m": self.X_WP.translation().tolist(),
            "angles_deg": np.degrees(angles_from_rotation(self.X_WP.rotation())).tolist(),
            "geometry": self.geometry,
            "lengths_m": self.lengths.tolist(),
            "directions": self.directions.T.tolist(),
        }

    def columns(self) -> dict[str, Any]:
        """A row a cable: name, length [m], direction."""
        directions = dict(zip(("u_x", "u_y", "u_z"), self.directions, strict=True))
        names = [cable.name for cable in self.robot.cables]
        return {"cable": names, "length_m": self.lengths, **directions}

    def plot(self) -> Figure:
        """The robot at the pose."""
        return plot(self.robot, self.X_WP)

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself."""
        place = numbers(self.X_WP.translation())
        return f"Cables of {self.robot.name} at ({place}) m, {self.geometry}", [
            ("lengths [m]", numbers(self.lengths, 5)),
            *(
                (f"u_{axis}", numbers(row))
                for axis, row in zip("xyz", self.directions, strict=True)
            ),
        ]


@verb()
def solve_static(
    robot: Robot | str | Path,
    pose: object = None,
    lengths: Array | Sequence[float] | None = None,
    model: str | None = None,
    pulleys: bool = True,
) -> RobotAtRest:
    """A robot at rest: lengths, tensions, stiffness, vibrations and sag.

    Args:
        robot: The robot, or its name or path.
        pose: X_WP as `as_pose` takes it [m], held by tensions of least 2-norm within the robot's
            bounds; None without lengths: the home pose.
        lengths: Instead of a pose: unstrained lengths from A to B, shape (m,) [m]; the robot
            hangs at the lowest pose of rest.
        model: A name of `cables.CABLE_MODELS`. Default: the robot file's `cable_model`, or elastic
            where it gives none.
        pulleys: Whether the cables run over the robot's pulleys.

    Raises:
        EquilibriumError: Pose and lengths, or a model or lengths that are not accepted; or no pose
            has these lengths.
        CdprError: The pose is outside the frame, or cannot be held; says why.
    """
    if pose is not None and lengths is not None:
        raise EquilibriumError("pose, lengths: found both; accepted: one of them")
    loaded = as_robot(robot, "solve_static")
    model = model or loaded.cable_model or ELASTIC
    _check_model(model, CABLE_MODELS)
    if lengths is None:
        found = static_at_pose(loaded, as_pose(loaded, pose), model, pulleys)
    else:
        found = static_at_lengths(loaded, _checked_lengths(loaded, lengths), model, pulleys)
    return as_kind(RobotAtRest, found)


@verb()
def find_equilibria(
    robot: Robot | str | Path,
    lengths: Array | Sequence[float] | None = None,
    position: Array | Sequence[float] | None = None,
    *,
    taut: Sequence[str] | None = None,
    model: str = "inextensible",
    pulleys: bool = True,
    searches: int = 1000,
    seed: int = 0,
    report: Callable[[int, int], object] | None = None,
) -> RobotEquilibria:
    """All poses of rest, stable or not, any cables slack, for lengths or at a position.

    Args:
        robot: The robot, or its name or path; of 1 to 8 cables.
        lengths: From A to B, of elastic cables unstrained ones, shape (m,) [m].
        position: Instead of lengths: where Po is, in W, shape (3,) [m].
        taut: Names of the cables that hold it at the position, all others slack; None: all.
        model: inextensible: all poses, from fixed exit points; elastic: searched.
        pulleys: True: elastic cables run over the robot's pulleys. False: pulleys are ignored, as
            always for inextensible cables; the result names its geometry.
        searches: Largest number of searches, of elastic cables.
        seed: Of their random starts.
        report: Called with work done and in all.

    Raises:
        EquilibriumError: There is none, or what is asked is not accepted; names it.
    """
    if (position is None) == (lengths is None):
        found = "neither" if position is None else "both"
        raise EquilibriumError(f"lengths, position: found {found}; accepted: one of them")
    if taut is not None and position is None:
        raise EquilibriumError("taut: found without position; accepted: with it")
    _check_model(model, EQUILIBRIA_MODELS)
    if searches < 1:
        raise EquilibriumError(f"searches: found {searches}; accepted: at least 1")
    if seed < 0:
        raise EquilibriumError(f"seed: found {seed}; accepted: at least 0")
    if position is not None and model == "elastic":
        raise EquilibriumError("position: found with elastic cables; accepted: inextensible ones")
    loaded = as_robot(robot, "find_equilibria")
    if position is not None:
        place = np.asarray(position, float)
        if place.shape != (3,) or not np.all(np.isfinite(place)):
            raise EquilibriumError(f"position: found {position}; accepted: x, y, z [m]")
        rests = equilibria_with_position(loaded, place, _taut(loaded, taut))
    else:
        assert lengths is not None
        given = _checked_lengths(loaded, lengths)
        if model == "elastic":
            rests = elastic_equilibria(
                loaded, given, pulleys, searches=searches, seed=seed, report=report
            )
        else:
            rests = equilibria_at_lengths(loaded, given, report=report)
    return as_kind(RobotEquilibria, rests, loaded=loaded)


@verb()
def solve_inverse_kinematics(
    robot: Robot | str | Path, pose: object = None, pulleys: bool = True
) -> CableLengths:
    """Lengths and directions of the cables at a pose.

    Args:
        robot: The robot, or its name or path.
        pose: X_WP as `as_pose` takes it [m]; None: the home pose.
        pulleys: False for cables that run straight from their exit points.

    Raises:
        CableGeometryError: A cable cannot run there.
        TensionProblemError: It is no pose, the pose is outside the frame, or the robot cannot have
            it.

    Source: servoing thesis (1.5), (1.15) to (1.17).
    """
    loaded = as_robot(robot, "solve_inverse_kinematics")
    X_WP = as_pose(loaded, pose)
    check_pose(loaded, X_WP)
    paths = cable_paths(X_WP, loaded.cable_set(pulleys))
    return CableLengths(loaded, X_WP, loaded.geometry_words(pulleys), paths.lengths, paths.u_W)


@verb()
def plot(robot: Robot | str | Path, pose: object = None) -> Figure:
    """A robot with its frame, cables and platform at a pose, in 3D.

    Args:
        robot: The robot, or its name or path.
        pose: X_WP as `as_pose` takes it [m]; None: the home pose.

    Raises:
        TensionProblemError: It is no pose.
    """
    from cdpr_drake.analyses.visualization.path_figures import poses_figure

    loaded = as_robot(robot, "plot")
    return poses_figure(loaded.title or loaded.name, loaded, {"platform": as_pose(loaded, pose)})


@verb()
def solve_forward_kinematics(
    robot: Robot | str | Path,
    lengths: Array | Sequence[float],
    guess: object = None,
    pulleys: bool = True,
) -> PoseFromLengths:
    """The pose near a guess at which the cables have given lengths, by least squares.

    Measured lengths of more cables than degrees of freedom contradict each other by their errors:
    the pose minimises the sum of squared residuals, and the result has the residuals, and the
    deviations of the pose that follow from their scatter. Read them: lengths that belong to no pose
    show there.

    Args:
        robot: The robot, or its name or path; with at least as many cables as degrees of freedom.
        lengths: Of the cables from A to B, stretched if they are elastic, shape (m,) [m].
        guess: X_WP as `as_pose` takes it [m]; None: the home pose.
        pulleys: False for cables that run straight from their exit points.

    Raises:
        ForwardKinematicsError: A residual is above a tenth of the mean length; without redundant
            cables, no pose near the guess has these lengths; or they do not determine one.

    Source: servoing thesis, section 2.2.3.
    """
    loaded = as_robot(robot, "solve_forward_kinematics")
    cables, words = loaded.cable_set(pulleys), loaded.geometry_words(pulleys)
    start: RigidTransform = as_pose(loaded, guess)
    solver = ForwardKinematics(cables, loaded.motion_type())
    given = _checked_lengths(loaded, lengths)
    return PoseFromLengths(loaded, given, solver.best_pose(given, start), words)


def _check_model(model: str, models: Collection[str]) -> None:
    if model not in models:
        raise EquilibriumError(f"model: {model!r} is unknown; {closest(model, models)}")


def _checked_lengths(robot: Robot, lengths: Array | Sequence[float]) -> Array:
    """Lengths as an array.

    Raises:
        EquilibriumError: Not one for each cable, or not above 0.
    """
    m = len(robot.cables)
    try:
        found = np.asarray(lengths, float)
    except (TypeError, ValueError):
        found = np.empty(0)
    if found.shape != (m,):
        raise EquilibriumError(
            f"lengths: found shape {found.shape}; accepted: ({m},), one for each cable of "
            f"{robot.name} [m]"
        )
    if not (np.all(np.isfinite(found)) and np.min(found) > 0.0):
        raise EquilibriumError(f"lengths: found {np.min(found):g}; accepted: > 0 [m]")
    return found


def _taut(robot: Robot, taut: Sequence[str] | None) -> list[int]:
    """Numbers of cables by their names; None: all that the robot has."""
    names = [cable.name for cable in robot.cables]
    if taut is None:
        return list(range(len(names)))
    for name in taut:
        if name not in names:
            raise EquilibriumError(f"taut: {name!r} is unknown; {closest(name, names)}")
    return [names.index(name) for name in taut]
