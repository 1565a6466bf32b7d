"""One trial of the study of tension methods: what to simulate, and its numbers step by step.

Scenarios of `cdpr simulate` run by `tension_control_run`; both advance by `analyses.simulation`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator, SimulatorStatus
from pydrake.systems.framework import Context, DiscreteValues, EventStatus

from cdpr_drake.analyses.simulation.run_loop import advance
from cdpr_drake.analyses.simulation.session import RunSession
from cdpr_drake.analyses.studies.framework.runs import Row, Run
from cdpr_drake.arrays import Array
from cdpr_drake.control.task_space import TaskGains
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
        path: The poses between which the desired motion goes, at rest in each.
        legs: Time of each stretch between two [s].
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
    path: tuple[RigidTransform, ...]
    legs: tuple[float, ...]
    method: str
    stiffness: float
    damping: float
    duration: float
    applied: Applied = Applied.HELD
    rate: float = 1000.0
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def keys(self) -> dict[str, Any]:
        """What tells its row from others."""
        return {
            "experiment": self.experiment,
            "robot": self.robot,
            "method": self.method,
            "applied": str(self.applied),
            "kp_per_s2": self.stiffness,
        }

    def trajectory(self) -> PoseTrajectory:
        """The desired motion."""
        return PoseTrajectory(self.path, self.legs)

    def build(self) -> TensionControl:
        """The diagram."""
        held = self.applied == Applied.HELD
        settings = TensionControlSettings(
            trajectory=self.trajectory(),
            gains=TaskGains(self.stiffness, self.damping),
            method=self.method,
            rate=self.rate,
            push=self.applied == Applied.PUSHED,
            distributor=TensionDistributor if held else UncheckedDistributor,
        )
        return build_tension_control(load_robot(self.robot), settings)


def label_of(keys: Run | Mapping[str, Any]) -> str:
    """A few words that tell a run from the others of its experiment."""
    words = f"{keys['method']}, Kp {keys['kp_per_s2']:g}"
    return words if keys["applied"] == Applied.HELD else f"{words}, {keys['applied']}"


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
        self._motion = spec.trajectory().motion
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


def run_trial(spec: TensionTrial) -> Row:
    """Simulates a specification; tensions are those that the distribution put out.

    Returns:
        kd_per_s, control_rate_hz, start_offset_m, wanted_duration_s: of the specification;
        end_time_s: less than wanted where the platform was lost; lost: whether it fell;
        position_error_max_m, position_error_mean_m, position_error_last_tenth_m: distance of Po
        from where it should be, the last in the last tenth of the run; tension_max_n,
        tension_min_n; tension_jump_max_n: largest change of one tension from one control step to
        the next; negative_tensions: over all steps and cables; failures: control steps whose
        tensions were out of bounds or not found; control_steps; times_s, shape (k,), and at these
        times errors_m, shape (k,), and tensions_n, shape (k, m).

    Raises:
        TensionProblemError: The method does not fit the robot.
    """
    control = spec.build()
    context = control.make_context()
    if any(spec.offset):
        start = spec.trajectory().pose(0.0)
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
    return _row(spec, rows, end.outcome == Outcome.DIVERGED, failures)


def _row(spec: TensionTrial, rows: Array, lost: bool, failures: int) -> Row:
    times, errors, tensions = rows[:, 0], rows[:, 1], rows[:, 2:]
    held = max(1, round(1.0 / (spec.rate * STEP)))  # integration steps per control step
    chosen = tensions[::held]
    jumps = np.abs(np.diff(chosen, axis=0))
    some = slice(None, None, max(1, len(times) // KEPT_ROWS))
    return {
        "kd_per_s": spec.damping, "control_rate_hz": spec.rate, "start_offset_m": spec.offset,
        "wanted_duration_s": spec.duration, "end_time_s": times[-1], "lost": lost,
        "position_error_max_m": np.max(errors), "position_error_mean_m": np.mean(errors),
        "position_error_last_tenth_m": np.mean(errors[-max(1, len(errors) // 10) :]),
        "tension_max_n": np.max(tensions), "tension_min_n": np.min(tensions),
        "tension_jump_max_n": np.max(jumps, initial=0.0),
        "negative_tensions": int(np.sum(chosen < 0.0)), "failures": failures,
        "control_steps": len(chosen),
        "times_s": times[some].copy(), "errors_m": errors[some].copy(),
        "tensions_n": tensions[some].copy(),
    }  # fmt: skip
