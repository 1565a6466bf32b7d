"""One trial that starts beside its path: what to simulate, and how large its tensions become.

It goes by compiled steps, without a diagram where the block is a `TensionDistributor`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiscreteValues

from cdpr_drake.analyses.studies.framework.runs import Row
from cdpr_drake.analyses.studies.tension_methods.trial import (
    LOST_DISTANCE,
    STEP,
    Applied,
    UncheckedDistributor,
)
from cdpr_drake.arrays import Array
from cdpr_drake.control.force_balance import FORCE, force_problem
from cdpr_drake.control.task_space import TaskGains
from cdpr_drake.errors import DivergedError, InfeasibleTensionError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.systems.controllers.tension_distributor import TensionDistributor
from cdpr_drake.systems.diagrams.tension_control import (
    TensionControl,
    TensionControlSettings,
    build_tension_control,
)
from cdpr_drake.systems.diagrams.tension_loop import TensionLoop, can_be_compiled
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.tensions.methods import exact_tensions
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

LOOK = 1.0
"""Time between looks at whether the platform is lost [s]."""

PULSE_RATE = 1.0 / STEP
"""Steps of Gazebo per second; forces that are set for one act so long [Hz]."""

LAST_PART = 0.5
"""Share of a run in which what came of its start is over."""

NOTHING, STATIC = "nothing", "tensions of rest"
"""What acts between steps in which commanded forces do; the second acts in these too."""


class PulsedDistributor(UncheckedDistributor):
    """An `UncheckedDistributor` whose tensions act for one step of Gazebo at each control step.

    Ports are those of `TensionDistributor`, but tensions are those that act; it is called once in
    every step of Gazebo. Where its method has no answer it asks for the lower limits.
    """

    def __init__(self, *settings: Any, every: int, between: Array, **options: Any) -> None:
        """Arguments as of `TensionDistributor`, with the rate of Gazebo's steps.

        Args:
            settings: Of `TensionDistributor`.
            every: Steps of Gazebo from one control step to the next.
            between: Tensions that act all the time, shape (m,) [N].
            options: Of `TensionDistributor`.
        """
        super().__init__(*settings, **options)
        self._every, self._between = every, between

    def _update(self, context: Context, state: DiscreteValues) -> None:
        acting = state.get_mutable_value(self._tensions)
        if round(context.get_time() * self.rate) % self._every:
            acting[:] = self._between
            return
        acting[:] = self.packed().bounds[0]
        super()._update(context, state)
        acting += self._between


@dataclass(frozen=True, kw_only=True, eq=False)
class StartTrial:
    """What to simulate.

    Attributes:
        experiment: Name of the experiment that the run belongs to.
        robot: Name of the robot.
        path: Where a straight path of Po starts and ends, shape (2, 3) [m].
        leg: Time that it takes [s].
        method: A name of `tensions.METHODS`.
        gain: Kp [1/s^2] and Kd [1/s].
        applied: What is done with tensions out of bounds.
        balance: A name of `force_balance.BALANCES`.
        rate: Control steps per second [Hz].
        start: Words for where the platform starts.
        position: That place of Po, shape (3,) [m].
        duration: Simulated time [s].
        between: What acts between the steps in which forces act; empty: they act all the time.
    """

    experiment: str
    robot: str
    path: tuple[Array, Array]
    leg: float
    method: str
    gain: float
    applied: Applied
    balance: str
    rate: float
    start: str
    position: Array
    duration: float
    between: str = ""

    def keys(self) -> dict[str, Any]:
        """What tells its row from others."""
        return {
            "experiment": self.experiment,
            "robot": self.robot,
            "method": self.method,
            "applied": str(self.applied),
            "kp_per_s2": self.gain,
            "balance": self.balance,
            "control_rate_hz": self.rate,
            "start": self.start,
            "between": self.between,
        }

    def name(self) -> str:
        """A name that no other run has."""
        words = (
            self.experiment, self.method, f"Kp {self.gain:g}", f"from {self.start}",
            self.balance, f"{self.rate:g} Hz", self.between,
        )  # fmt: skip
        return " ".join(word for word in words if word)

    def start_error(self) -> float:
        """How far it starts from its path's start [m]."""
        return float(np.linalg.norm(self.position - self.path[0]))

    def build(self) -> TensionControl:
        """The diagram."""
        robot = load_robot(self.robot)
        settings = TensionControlSettings(
            trajectory=PoseTrajectory(
                tuple(pose_from_angles(p, np.zeros(3)) for p in self.path), (self.leg,)
            ),
            gains=TaskGains(self.gain, self.gain),
            method=self.method,
            rate=PULSE_RATE if self.between else self.rate,
            balance=self.balance,
            push=self.applied == Applied.PUSHED,
            distributor=self._distributor(robot),
            rule=StepRule(max_step=STEP),
        )
        return build_tension_control(robot, settings, log_rate=settings.rate)

    def resting_tensions(self, robot: Robot) -> Array:
        """What acts between, shape (m,) [N]: nothing, or what holds the weight at home."""
        if self.between != STATIC:
            return np.zeros(len(robot.cables))
        cables = robot.cable_set(pulleys=False)  # those of the simulated robot
        problem = tension_problem(robot, robot.home.transform(), cables=cables)
        if self.balance == FORCE:
            problem = force_problem(problem, robot.motion_type().num_turns)
        found = exact_tensions(problem)
        if found is None:
            raise InfeasibleTensionError(f"{robot.name}: no tensions hold the platform at home")
        return found

    def _distributor(self, robot: Robot) -> Any:
        if self.between:
            every = round(PULSE_RATE / self.rate)
            return partial(PulsedDistributor, every=every, between=self.resting_tensions(robot))
        return TensionDistributor if self.applied == Applied.HELD else UncheckedDistributor


class _DiagramLoop:
    """A `TensionControl` in Drake's simulator, used as a `TensionLoop` is."""

    def __init__(self, control: TensionControl, start: RigidTransform) -> None:
        self.control = control
        self._context = control.make_context()
        control.set_pose(self._context, start)
        self._simulator = Simulator(control.diagram, self._context)
        self._simulator.Initialize()

    def advance_to(self, time: float) -> None:
        self._simulator.AdvanceTo(time)

    def errors(self) -> tuple[float, float]:
        return self.control.errors(self._context)

    def columns(self) -> dict[str, Array]:
        log = self.control.log
        assert log is not None
        return log.read(self._context)


def run_start_trial(spec: StartTrial) -> Row:
    """Simulates a specification.

    Returns:
        start_error_m; wanted_duration_s, end_time_s: less than wanted where the platform was lost;
        lost; tension_max_n, tension_min_n: over the run, as the distribution asked for;
        tension_first_max_n: the largest of the first control step; tension_last_max_n: the largest
        in the last half of a run that was not lost, else None; turn_max_rad: largest angle from
        where it is unturned, over all control steps; position_error_last_tenth_m: mean distance of
        Po from where it should be; failures, control_steps.

    Raises:
        TensionProblemError: The method does not fit the robot.
    """
    control = spec.build()
    start = pose_from_angles(spec.position, np.zeros(3))
    loop: TensionLoop | _DiagramLoop
    if can_be_compiled(control):
        loop = TensionLoop(control, spec.rate, start)
    else:
        loop = _DiagramLoop(control, start)
    limit, lost, time = LOST_DISTANCE + spec.start_error(), False, 0.0
    while time < spec.duration and not lost:
        time = min(time + LOOK, spec.duration)
        try:
            loop.advance_to(time)
        except DivergedError:
            lost = True
        else:
            lost = not loop.errors()[0] < limit
    return _row(spec, control, loop.columns(), lost)


def _row(spec: StartTrial, control: TensionControl, log: dict[str, Array], lost: bool) -> Row:
    robot = control.robot
    times, states, tensions = log["time"], log["platform_state"], log["tensions"]
    # A row stands before the control step of its time: the next one has what this step asked for.
    if spec.between:
        chosen = slice(1, None, round(PULSE_RATE / spec.rate))
        tensions = tensions - spec.resting_tensions(robot)
    else:
        chosen = slice(1, None)
    asked = tensions[chosen]
    tenth = slice(-max(1, len(times) // 10), None)
    where = np.array([control.trajectory.motion(time)[4:7] for time in times[tenth]])
    away = np.linalg.norm(states[tenth, 4:7] - where, axis=1)
    q = states[:, :4] / np.linalg.norm(states[:, :4], axis=1)[:, np.newaxis]
    last = asked[round((1.0 - LAST_PART) * len(asked)) :]
    return {
        "start_error_m": spec.start_error(), "wanted_duration_s": spec.duration,
        "end_time_s": times[-1], "lost": lost,
        "tension_max_n": np.max(asked), "tension_min_n": np.min(asked),
        "tension_first_max_n": np.max(asked[0]),
        "tension_last_max_n": None if lost else np.max(last),
        "turn_max_rad": 2.0 * np.max(np.arctan2(np.linalg.norm(q[:, 1:], axis=1), np.abs(q[:, 0]))),
        "position_error_last_tenth_m": np.mean(away),
        "failures": int(log["failures"][-1, 0]), "control_steps": len(asked),
    }  # fmt: skip
