"""One trial of the study of tension methods: what to simulate, and its numbers step by step.

Scenarios of `cdpr simulate` run by `tension_control_run`; both advance by `analyses.simulation`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from enum import StrEnum
from typing import Any

import numpy as np
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator, SimulatorStatus
from pydrake.systems.framework import Context, DiscreteValues, EventStatus

from cdpr_drake.analyses.simulation.run_loop import advance
from cdpr_drake.analyses.simulation.session import RunSession
from cdpr_drake.arrays import Array
from cdpr_drake.control.task_space import TaskGains
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.controllers.tension_distributor import TensionDistributor
from cdpr_drake.systems.diagrams.tension_control import (
    TensionControl,
    TensionControlSettings,
    build_tension_control,
)
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.tensions.methods import METHODS
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

STEP = 1e-3
"""Step of the integrator, Runge-Kutta of third order [s]."""

LOST_DISTANCE = 1.0
"""A platform so far from where it should be has fallen; the trial ends [m]."""

KEPT_ROWS = 4000
"""Rows of a run's history that are kept for figures, about."""

BALANCE = 1e-6
"""Tensions balance the wrench if they miss it by at most this, relative to the cables' forces."""


class UncheckedDistributor(TensionDistributor):
    """A `TensionDistributor` that puts out what its method computes, outside the bounds too.

    Its ports are those of `TensionDistributor`; `failures` counts the control steps whose tensions
    left the bounds all the same. An exact method has no answer where there is none within the
    bounds, and what does not balance the wrench is none either: then the last tensions are held.
    """

    def _update(self, context: Context, state: DiscreteValues) -> None:
        super()._update(context, state)
        met = state.get_value(self._feasible)[0] == 1.0
        if met or METHODS[self._method].exact or not np.all(np.isfinite(self._t)):
            return
        missing = self._W @ self._t - self._wrench(context)[self._rows]
        if np.linalg.norm(missing) <= BALANCE * np.linalg.norm(np.abs(self._W) @ np.abs(self._t)):
            state.get_mutable_value(self._tensions)[:] = self._t


class Applied(StrEnum):
    """What is done with tensions out of bounds.

    HELD: the last ones within are applied, as `TensionDistributor` does. CUT: they are applied,
    but a negative one acts as zero, as in a cable. PUSHED: a negative one pushes, as in a rod.
    """

    HELD = "held"
    CUT = "cut"
    PUSHED = "pushed"


@dataclass(frozen=True, kw_only=True, eq=False)
class TensionTrial:
    """What to simulate.

    Attributes:
        experiment: Name of the experiment that the run belongs to.
        robot: Name of the robot.
        trajectory: The desired motion.
        method: A name of `tensions.METHODS`.
        stiffness: Kp, for rotation and translation [1/s^2].
        damping: Kd, the same [1/s].
        duration: Simulated time [s].
        applied: What is done with tensions out of bounds.
        rate: Control steps per second [Hz].
        offset: Where the platform starts beside the trajectory, shape (3,) in W [m].
    """

    experiment: str
    robot: str
    trajectory: PoseTrajectory
    method: str
    stiffness: float
    damping: float
    duration: float
    applied: Applied = Applied.HELD
    rate: float = 1000.0
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def name(self) -> str:
        """What no other run of the study is called."""
        return f"{self.experiment} {self.label}"

    @property
    def label(self) -> str:
        """A few words that tell it from the other runs of its experiment."""
        words = f"{self.method}, Kp {self.stiffness:g}"
        return words if self.applied == Applied.HELD else f"{words}, {self.applied}"

    def arguments(self) -> dict[str, Any]:
        """All that the run depends on but the code, for JSON."""
        return {
            **self.parameters(),
            "path": [pose_row(pose).tolist() for pose in self.trajectory.poses],
            "legs_s": list(self.trajectory.durations),
        }

    def parameters(self) -> dict[str, Any]:
        """What a row of the results says of it."""
        return {
            "experiment": self.experiment,
            "robot": self.robot,
            "method": self.method,
            "applied": str(self.applied),
            "kp_per_s2": self.stiffness,
            "kd_per_s": self.damping,
            "control_rate_hz": self.rate,
            "start_offset_m": list(self.offset),
            "wanted_duration_s": self.duration,
        }

    def build(self) -> TensionControl:
        """The diagram."""
        held = self.applied == Applied.HELD
        settings = TensionControlSettings(
            trajectory=self.trajectory,
            gains=TaskGains(self.stiffness, self.damping),
            method=self.method,
            rate=self.rate,
            push=self.applied == Applied.PUSHED,
            distributor=TensionDistributor if held else UncheckedDistributor,
        )
        return build_tension_control(load_robot(self.robot), settings)


@dataclass(frozen=True, kw_only=True, eq=False)
class TrialResult:
    """What a run did; tensions are those that the distribution put out.

    Attributes:
        spec: What was simulated.
        end_time: Simulated time, less than the specification's where the platform was lost [s].
        lost: Whether the platform fell.
        largest_error: Largest distance of Po from where it should be [m].
        mean_error: Its mean over time [m].
        last_error: Its mean over the last tenth of the run [m].
        largest_tension: [N].
        smallest_tension: [N].
        largest_jump: Largest change of one tension from one control step to the next [N].
        negative_tensions: Number of tensions below zero, over all steps and cables.
        failures: Control steps whose tensions were out of bounds or not found.
        steps: Control steps.
        wall_time: Time that the simulation took [s].
        times: Some times, shape (k,) [s].
        errors: The distance at those times, shape (k,) [m].
        tensions: Tensions at those times, shape (k, m) [N].
    """

    spec: TensionTrial
    end_time: float
    lost: bool
    largest_error: float
    mean_error: float
    last_error: float
    largest_tension: float
    smallest_tension: float
    largest_jump: float
    negative_tensions: int
    failures: int
    steps: int
    wall_time: float
    times: Array = field(repr=False)
    errors: Array = field(repr=False)
    tensions: Array = field(repr=False)

    def as_dict(self) -> dict[str, Any]:
        """The run for JSON, without its history."""
        return {
            **self.spec.parameters(),
            "end_time_s": self.end_time,
            "lost": self.lost,
            "position_error_max_m": self.largest_error,
            "position_error_mean_m": self.mean_error,
            "position_error_last_tenth_m": self.last_error,
            "tension_max_n": self.largest_tension,
            "tension_min_n": self.smallest_tension,
            "tension_jump_max_n": self.largest_jump,
            "negative_tensions": self.negative_tensions,
            "failures": self.failures,
            "control_steps": self.steps,
            "wall_time_s": self.wall_time,
        }


HISTORY = ("times", "errors", "tensions")
"""Attributes of a `TrialResult` that are arrays."""

NUMBERS: dict[str, type] = {
    each.name: {"bool": bool, "int": int, "float": float}[str(each.type)]
    for each in fields(TrialResult)
    if each.name not in ("spec", *HISTORY)
}
"""Its other attributes but `spec`, each with its type, in their order."""


class _Recorder:
    """A monitor that keeps position and tensions of every step, and ends a run that is lost."""

    def __init__(self, control: TensionControl, context: Context, spec: TensionTrial) -> None:
        rows = round(spec.duration / STEP) + 2
        plant = control.in_plant.plant
        self._instance = control.in_plant.model_instance
        self._positions = plant.GetPositions
        self._plant_context = plant.GetMyContextFromRoot(context)
        distributor = control.diagram.GetSubsystemByName("distributor")
        self._tensions = distributor.GetOutputPort("tensions").Eval
        self._distributor_context = distributor.GetMyContextFromRoot(context)
        self._motion = spec.trajectory.motion
        self.rows = np.empty((rows, 2 + len(control.robot.cables)))
        self.count = 0
        self.lost = False

    def __call__(self, context: Context) -> EventStatus:
        now = context.get_time()
        if now == 0.0 or self.count == len(self.rows):  # before the first control step
            return EventStatus.DidNothing()
        row = self.rows[self.count]
        place = self._positions(self._plant_context, self._instance)[4:7]
        away = place - self._motion(now)[4:7]
        row[0], row[1] = now, np.sqrt(away @ away)
        row[2:] = self._tensions(self._distributor_context)
        self.count += 1
        self.lost = not row[1] < LOST_DISTANCE
        if self.lost:
            return EventStatus.ReachedTermination(None, "lost")
        return EventStatus.DidNothing()


@dataclass(frozen=True, eq=False)
class TrialTask:
    """A run as the one item of a task of a sweep.

    Attributes:
        spec: What to simulate.
    """

    spec: TensionTrial

    def __call__(self, start: int, stop: int) -> dict[str, Array]:
        """Arrays of `TrialResult` and `NUMBERS`, with the run as first axis."""
        run = run_trial(self.spec)
        numbers = [float(getattr(run, name)) for name in NUMBERS]
        arrays = {"numbers": np.array(numbers)} | {name: getattr(run, name) for name in HISTORY}
        return {name: array[np.newaxis] for name, array in arrays.items()}

    def result(self, arrays: Mapping[str, Array]) -> TrialResult:
        """The run of which these are the arrays."""
        numbers = {
            name: NUMBERS[name](value)
            for name, value in zip(NUMBERS, arrays["numbers"][0].tolist(), strict=True)
        }
        return TrialResult(spec=self.spec, **numbers, **{name: arrays[name][0] for name in HISTORY})


def run_trial(spec: TensionTrial) -> TrialResult:
    """Simulates a specification.

    Raises:
        TensionProblemError: The method does not fit the robot.
    """
    control = spec.build()
    context = control.make_context()
    if any(spec.offset):
        start = spec.trajectory.pose(0.0)
        start.set_translation(start.translation() + spec.offset)
        plant_context = control.in_plant.plant.GetMyMutableContextFromRoot(context)
        control.in_plant.set_pose(plant_context, start)
    simulator = Simulator(control.diagram, context)
    ResetIntegratorFromFlags(simulator, "runge_kutta3", STEP).set_fixed_step_mode(True)
    recorder = _Recorder(control, context, spec)
    simulator.set_monitor(recorder)

    def outcome_after(status: SimulatorStatus) -> Outcome:
        if recorder.lost:
            return Outcome.DIVERGED
        done = context.get_time() >= spec.duration * (1.0 - 1e-9)
        return Outcome.COMPLETED if done else Outcome.RUNNING

    end = advance(
        simulator,
        spec.duration,
        outcome_after,
        lambda: control.errors(context),
        RunSession(),
    )
    if end.outcome == Outcome.INTERRUPTED:  # what is there is not a whole run
        raise KeyboardInterrupt
    failures = int(control.diagram.GetOutputPort("failures").Eval(context)[0])
    rows = recorder.rows[: recorder.count]
    return _judge(spec, rows, end.outcome == Outcome.DIVERGED, failures, end.wall_time)


def _judge(
    spec: TensionTrial, rows: Array, lost: bool, failures: int, wall_time: float
) -> TrialResult:
    times, errors, tensions = rows[:, 0], rows[:, 1], rows[:, 2:]
    held = max(1, round(1.0 / (spec.rate * STEP)))  # integration steps per control step
    chosen = tensions[::held]
    jumps = np.abs(np.diff(chosen, axis=0))
    some = slice(None, None, max(1, len(times) // KEPT_ROWS))
    return TrialResult(
        spec=spec,
        end_time=float(times[-1]),
        lost=lost,
        largest_error=float(np.max(errors)),
        mean_error=float(np.mean(errors)),
        last_error=float(np.mean(errors[-max(1, len(errors) // 10) :])),
        largest_tension=float(np.max(tensions)),
        smallest_tension=float(np.min(tensions)),
        largest_jump=float(np.max(jumps, initial=0.0)),
        negative_tensions=int(np.sum(chosen < 0.0)),
        failures=failures,
        steps=len(chosen),
        wall_time=wall_time,
        times=times[some].copy(),
        errors=errors[some].copy(),
        tensions=tensions[some].copy(),
    )
