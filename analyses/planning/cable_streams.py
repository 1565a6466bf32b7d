"""A planned motion as cable lengths and motor angles over time, as drives follow them.

Lengths are unstrained: what a winch has to have let out for the cable to have the plan's tension at
the platform there, with its stretch and, by the model catenary, its sag. Drives go from one point
of the stream to the next at constant rate, while the platform goes on along its curve: the check
asks the cables' tensions between points, where a stream that is too coarse lets them go slack.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.frame.folder import Folder
from cdpr_drake.analyses.frame.result import Result, Table
from cdpr_drake.analyses.planning.plan_tracking import MOMENT
from cdpr_drake.analyses.reporting.exported_logs import write_columns
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.arrays import Array
from cdpr_drake.cables.elastic_law import unstrained_lengths
from cdpr_drake.cables.models import CABLE_MODELS, CATENARY, ELASTIC
from cdpr_drake.cables.states import cable_derivatives, cable_state
from cdpr_drake.errors import CdprError, PlanningError, accepted_names
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.models.robot_holding import hold_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.planning.path_task import sample_motion
from cdpr_drake.trajectories.sampled_motion import TIME_COLUMN

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cdpr_drake.analyses.planning.plans import Plan

MODELS = (ELASTIC, CATENARY)  # cable models whose tension follows from their length

LENGTHS, ANGLES, CHECK = "lengths.csv", "motor_angles.csv", "stream.json"

RATES = (1.0, 10_000.0)  # least and largest rate of a stream [Hz]
BETWEEN = 4  # instants between two points at which tensions are asked

MOST_POINTS = 200_000

ROUNDS = 40  # steps of Newton for a sagging cable; six do, a cable that starts slack takes more
CLOSE = 1e-9  # of the tension, where they end


@dataclass(frozen=True, eq=False, repr=False)
class CableStream(Result):
    """A motion as drives follow it.

    Attributes:
        robot: The robot.
        model: Name of the cable model.
        rate: Points a second; the last point is the end of the motion [Hz].
        times: Shape (k,) [s].
        lengths: Unstrained lengths from exit to anchor point, shape (k, m) [m].
        motor_angles: Zero at the home pose at rest, positive pays out, shape (k, m) [rad].
        zero_lengths: Unstrained lengths at the zero of the angles, shape (m,) [m].
        stretch: By how much cables are longer under load, shape (k, m) [m].
        least: Least tension of each cable at points and between them, for drives that follow the
            stream, shape (m,) [N].
        least_at: When each has it, shape (m,) [s].
        largest: Largest tension of each cable, shape (m,) [N].
        slack: Instants at which each cable is slack, shape (m,).
        instants: Instants that were checked.
    """

    robot: Robot
    model: str
    rate: float
    times: Array
    lengths: Array
    motor_angles: Array
    zero_lengths: Array
    stretch: Array
    least: Array
    least_at: Array
    largest: Array
    slack: Array
    instants: int

    @property
    def names(self) -> list[str]:
        """Of the cables."""
        return [cable.name for cable in self.robot.cables]

    @property
    def keeps_taut(self) -> bool:
        """True if no cable is slack anywhere."""
        return not np.any(self.slack)

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""

        def by_cable(values: Array) -> dict[str, float]:
            return dict(zip(self.names, values.tolist(), strict=True))

        result: dict[str, Any] = finite({
            "model": self.model,
            "rate_hz": self.rate,
            "points": len(self.times),
            "zero_lengths_m": by_cable(self.zero_lengths),
            "largest_stretch_mm": 1e3 * float(np.max(self.stretch)),
            "instants_checked": self.instants,
            "least_tension_n": by_cable(self.least),
            "least_tension_at_s": by_cable(self.least_at),
            "largest_tension_n": by_cable(self.largest),
            "slack_instants": by_cable(self.slack),
            "keeps_taut": self.keeps_taut,
        })  # fmt: skip
        return result

    @property
    def verdict(self) -> str:
        """Whether it keeps cables taut, in words."""
        return "no cable goes slack" if self.keeps_taut else "CABLES GO SLACK"

    def tables(self) -> list[Table]:
        """Tensions of drives that follow it."""
        rows = [
            (name, f"{self.least[k]:.4g}", f"{self.least_at[k]:.4g}", f"{self.largest[k]:.4g}",
             str(self.slack[k]))
            for k, name in enumerate(self.names)
        ]  # fmt: skip
        headings = ("cable", "least [N]", "at [s]", "largest [N]", "slack instants")
        return [Table(f"{self.robot.name}: tensions of the stream", headings, rows)]

    def lines(self) -> list[str]:
        """Its points, and whether it keeps cables taut."""
        k = int(np.argmin(self.least))
        return [
            f"stream of {len(self.times)} points at {self.rate:g} Hz, {self.model}: {self.verdict} "
            f"at points or between them; least tension {self.least[k]:.4g} N in {self.names[k]} at "
            f"{self.least_at[k]:.4g} s"
        ]

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """Lengths and motor angles over time, and by how much lengths are below straight ways."""
        return {"stream": self._draw}

    def _draw(self) -> Figure:
        from cdpr_drake.analyses.planning.plan_figures import Panel, panel_figure

        title = (
            f"{self.robot.name}: stream of {len(self.times)} points at {self.rate:g} Hz, "
            f"{self.model} cables\n{self.verdict}; angles are zero at the home pose at rest"
        )
        below = "stretch less sag" if CABLE_MODELS[self.model].sags else "stretch"
        panels = [
            Panel(label, dict(zip(self.names, values.T, strict=True)))
            for label, values in (
                ("unstrained length [m]", self.lengths),
                ("motor angle [turns],\npositive pays out", self.motor_angles / (2.0 * np.pi)),
                (f"{below} [mm]", 1e3 * self.stretch),
            )
        ]
        return panel_figure(title, (11.0, 9.0), self.times, panels, one_legend=True)

    def write(self, folder: Folder) -> None:
        """Writes lengths, motor angles and what was checked."""
        for file, values, unit in (
            (LENGTHS, self.lengths, "unstrained_length_m"),
            (ANGLES, self.motor_angles, "motor_angle_rad"),
        ):
            columns = {f"{name}_{unit}": values[:, k] for k, name in enumerate(self.names)}
            with folder.file(file) as part:
                write_columns(part, {TIME_COLUMN: self.times, **columns})
        folder.write_json(CHECK, self.as_dict())


def cable_stream(plan: Plan, rate: float, model: str | None = None) -> CableStream:
    """A planned motion as unstrained lengths and motor angles, and whether cables stay taut.

    Args:
        plan: The plan.
        rate: Points a second [Hz].
        model: A name of `MODELS`. Default: catenary if the robot file's cables sag, else elastic.

    Raises:
        PlanningError: The rate or the model is not accepted, the plan's tensions are none that a
            cable can have, or winches hold several cables.
    """
    robot = plan.robot
    if model is None:
        sags = robot.cable_model is not None and CABLE_MODELS[robot.cable_model].sags
        model = CATENARY if sags else ELASTIC
    if model not in MODELS:
        raise PlanningError(f"stream: model: found {model!r}; {accepted_names(model, MODELS)}")
    if not RATES[0] <= rate <= RATES[1]:
        raise PlanningError(
            f"stream: rate: found {rate:g} Hz; accepted: {RATES[0]:g} to {RATES[1]:g} Hz"
        )
    end = plan.motion.end_time
    if end * rate > MOST_POINTS:
        raise PlanningError(
            f"stream: found {end * rate:.0f} points; accepted: at most {MOST_POINTS}"
        )
    cables, motion = plan.task.cables, plan.motion
    times = np.arange(int(end * rate + MOMENT) + 1) / rate
    if end > times[-1] + MOMENT:
        times = np.append(times, end)
    planned = sample_motion(plan.task, motion, times).tensions
    poses = [motion.pose(float(t)) for t in times]
    lengths = np.array([
        _unstrained(cables, model, X, t, when)
        for X, t, when in zip(poses, planned, times, strict=True)
    ])  # fmt: skip
    straight = np.array([cable_paths(X, cables).lengths for X in poses])
    zero = _zero_lengths(robot, cables, model, lengths[0])
    share = np.arange(BETWEEN + 1) / (BETWEEN + 1)
    instants = (times[:-1, None] + share * np.diff(times)[:, None]).ravel()
    instants = np.append(instants, times[-1])
    followed = np.column_stack([np.interp(instants, times, column) for column in lengths.T])
    states = [
        cable_state(cables, model, motion.pose(float(t)), l0)
        for t, l0 in zip(instants, followed, strict=True)
    ]
    tensions = np.array([state.tensions for state in states])
    return CableStream(
        robot=robot, model=model, rate=rate, times=times, lengths=lengths,
        motor_angles=np.asarray(robot.drum().motor_angles(lengths - zero)), zero_lengths=zero,
        stretch=straight - lengths, least=tensions.min(axis=0),
        least_at=instants[np.argmin(tensions, axis=0)], largest=tensions.max(axis=0),
        slack=np.sum([state.slack for state in states], axis=0), instants=len(instants),
    )  # fmt: skip


def _zero_lengths(robot: Robot, cables: CableSet, model: str, first: Array) -> Array:
    """Unstrained lengths at rest at home; where nothing holds that, those of the first point."""
    try:
        return hold_robot(robot, robot.home.transform(), cables, model).unstrained_lengths
    except CdprError:
        return first


def _unstrained(cables: CableSet, model: str, X: RigidTransform, t: Array, when: float) -> Array:
    """Unstrained lengths at which cables have these tensions at the platform, shape (m,) [m]."""
    straight = cable_paths(X, cables).lengths
    l0 = unstrained_lengths(straight, t, cables.stiffness)
    if not CABLE_MODELS[model].sags:
        return l0
    for _ in range(ROUNDS):
        off = cable_state(cables, model, X, l0).tensions - t
        if np.all(np.abs(off) <= CLOSE * np.maximum(t, 1.0)):
            return l0
        slope = cable_derivatives(cables, model, X, l0).tensions_by_length
        step = np.clip(off / np.minimum(slope, -1e-6), -0.02 * straight, 0.02 * straight)
        l0 = l0 - step
    k = int(np.argmax(np.abs(off)))
    raise PlanningError(
        f"stream: at {when:.4g} s: found no length at which cable {k + 1} has {t[k]:.4g} N with "
        "its weight; accepted: tensions that carry the cable, with limits"
    )
