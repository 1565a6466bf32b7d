"""Trials of the study of tension methods: what is simulated, and its numbers.

Trials of the thesis' path go by Drake's simulator, recorded in each step; those that start beside
it by compiled steps, without a diagram where the block is a `TensionDistributor`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from functools import cache, partial
from itertools import product
from typing import Any

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator, SimulatorStatus
from pydrake.systems.framework import Context, DiscreteValues, EventStatus

from cdpr_drake.analyses.reporting.timing import interleaved, seconds_each, seconds_per_call
from cdpr_drake.analyses.simulation.run_loop import advance
from cdpr_drake.analyses.simulation.session import RunSession
from cdpr_drake.analyses.statics.tension_query import applicable_methods
from cdpr_drake.arrays import Array
from cdpr_drake.control.force_balance import FORCE, WRENCH, force_problem
from cdpr_drake.control.task_space import TaskGains
from cdpr_drake.errors import DivergedError, InfeasibleTensionError, TensionProblemError
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
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.tensions.methods import METHODS, distribute, distribute_batch, exact_tensions
from cdpr_drake.tensions.problem import TensionProblem, TensionStatus
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


def run_trial(spec: TensionTrial) -> dict[str, Any]:
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
    return _trial_row(spec, rows, end.outcome == Outcome.DIVERGED, failures)


def _trial_row(spec: TensionTrial, rows: Array, lost: bool, failures: int) -> dict[str, Any]:
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


def run_start_trial(spec: StartTrial) -> dict[str, Any]:
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
    return _start_row(spec, control, loop.columns(), lost)


def _start_row(
    spec: StartTrial, control: TensionControl, log: dict[str, Array], lost: bool
) -> dict[str, Any]:
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


PATH_STEPS = 1000
"""Poses of a straight path that are tried, beside its end."""

FINE = 1e-6
"""How closely the least shift is found [m]."""


@dataclass(frozen=True)
class HeldPath:
    """A straight path of Po that the robot holds everywhere, and what was changed for it.

    Attributes:
        start: Where it starts, shape (3,) [m].
        end: Where it ends, shape (3,) [m].
        start_limit: Least distance by which the start had to move towards the inside [m].
        end_limit: The same of the end [m].
        start_shift: Distance by which the start moved, its limit and the margin [m].
        end_shift: The same of the end [m].
    """

    start: Array
    end: Array
    start_limit: float
    end_limit: float
    start_shift: float
    end_shift: float


def can_hold(robot: Robot, position: Array, limits: tuple[float, float] | None = None) -> bool:
    """Whether tensions hold the unturned platform at rest with Po at a position [m]; exact."""
    X_WP = pose_from_angles(position, np.zeros(3))
    cables = robot.cable_set(pulleys=False)  # as in the theses
    return exact_tensions(tension_problem(robot, X_WP, limits=limits, cables=cables)) is not None


def held_path(
    robot: Robot,
    start: Array,
    end: Array,
    inside: Array,
    margin: float = 0.01,
    limits: tuple[float, float] | None = None,
) -> HeldPath:
    """Moves each end straight towards the inside until it and then the path between can be held.

    Args:
        robot: The robot.
        start: Wanted start of Po, unturned platform, shape (3,) [m].
        end: Wanted end, shape (3,) [m].
        inside: A position that can be held, shape (3,) [m].
        margin: What an end moves beyond its limit, if it has to move at all: at the limit itself
            no tensions are left to control with [m].
        limits: Smallest and largest tension [N]; None: the robot's.

    Raises:
        InfeasibleTensionError: The inside cannot be held, or no such path was found.
    """
    start, end, inside = (np.asarray(p, float) for p in (start, end, inside))
    if not can_hold(robot, inside, limits):
        raise InfeasibleTensionError(f"{robot.name}: no tensions hold the platform at {inside}")
    bounds = [_least_shift(robot, p, inside, limits) for p in (start, end)]
    shifts = [bound + margin if bound > 0.0 else 0.0 for bound in bounds]
    while True:
        ends = [_towards(p, inside, shift) for p, shift in zip((start, end), shifts, strict=True)]
        shares = np.linspace(0.0, 1.0, PATH_STEPS + 1)
        bad = [s for s in shares if not can_hold(robot, ends[0] + s * (ends[1] - ends[0]), limits)]
        if not bad:
            return HeldPath(ends[0], ends[1], bounds[0], bounds[1], shifts[0], shifts[1])
        nearer = 0 if np.mean(bad) <= 0.5 else 1  # the end next to what cannot be held
        shifts[nearer] += margin
        if margin <= 0.0 or shifts[nearer] > float(np.linalg.norm((start, end)[nearer] - inside)):
            raise InfeasibleTensionError(f"{robot.name}: found no path that can be held throughout")


def _towards(position: Array, inside: Array, shift: float) -> Array:
    way = inside - position
    length = float(np.linalg.norm(way))
    return position + way * (min(shift / length, 1.0) if length > 0.0 else 0.0)


def _least_shift(
    robot: Robot, position: Array, inside: Array, limits: tuple[float, float] | None
) -> float:
    """Least distance towards the inside from which on the platform is held, by bisection [m]."""
    if can_hold(robot, position, limits):
        return 0.0
    bad, good = 0.0, float(np.linalg.norm(inside - position))
    while good - bad > FINE:
        middle = (bad + good) / 2.0
        if can_hold(robot, _towards(position, inside, middle), limits):
            good = middle
        else:
            bad = middle
    return good


THESIS_ROBOT = "caroca_gazebo"
OTHER_ROBOT = "acrobot_large"

THESIS_START = (0.0, -2.0, 2.0)
THESIS_END = (3.0, 1.0, 3.0)
"""Gazebo thesis 6.2, the middle of the platform [m]."""

THESIS_DURATION = 100.0
"""Gazebo thesis 6.2 [s]."""

THESIS_GAINS: dict[str, tuple[float, ...]] = {
    "linear_program": (100.0, 800.0, 1200.0),
    "quadratic_program": (100.0, 800.0, 1200.0, 1500.0),
    "pseudo_inverse": (100.0, 800.0, 1200.0),
    "closed_form": (100.0, 800.0, 1200.0),
}
"""Kp = Kd of the methods that the Gazebo thesis runs, figures 6.8 to 6.20 [1/s^2, 1/s]."""

UNCHECKED = ("pseudo_inverse", "closed_form")
"""Methods of the thesis that may leave the bounds."""

STEPS_BELOW = {"step": 0.005, "far_step": 0.05}
"""How far below its goal the platform starts in two experiments, chosen [m]."""

EXPERIMENTS = {
    "thesis": "The Gazebo thesis' trajectory, its start moved inside; Kp = Kd, 1 kHz.",
    "printed": "The same with its printed start, which no tensions within bounds hold.",
    "step": f"The thesis' robot {1e3 * STEPS_BELOW['step']:g} mm below its goal, at rest.",
    "far_step": f"The thesis' robot {1e3 * STEPS_BELOW['far_step']:g} mm below its goal, at rest.",
    "slow": "The thesis' trajectory, its first part, controlled at 100 Hz.",
    "acrobot": "acrobot_large there and back, Kp = 100, Kd = 20, 1 kHz.",
}
"""What the experiments are, by name."""


GRID, QUICK_GRID = (13, 13, 9), (5, 5, 3)
"""Poses on which methods are compared, along x, y and z."""


@cache
def thesis_path() -> HeldPath:
    """How the thesis' path was moved inside; positions of Po."""
    robot = load_robot(THESIS_ROBOT)
    return held_path(robot, *printed_ends(), robot.home.position)


def printed_ends() -> tuple[np.ndarray, np.ndarray]:
    """Where the thesis' path starts and ends, shape (3,) each, of Po [m]."""
    # The thesis' platform frame lies in the middle of the box, P in the middle of its bottom.
    middle = np.array([0.0, 0.0, float(load_robot(THESIS_ROBOT).platform.size[2]) / 2.0])
    return np.array(THESIS_START) - middle, np.array(THESIS_END) - middle


def trials(quick: bool) -> list[TensionTrial]:
    """All runs, or short ones that only show that everything works, in the order of the
    experiments."""
    specs = _thesis(thesis_path(), quick) + _printed(printed_ends(), quick) + _acrobot(quick)
    if not quick:
        specs += _step() + _slow(thesis_path())
    order = list(EXPERIMENTS)
    return sorted(specs, key=lambda spec: order.index(spec.experiment))


def _straight(start: np.ndarray, end: np.ndarray, duration: float) -> dict[str, Any]:
    poses = tuple(pose_from_angles(p, np.zeros(3)) for p in (start, end))
    return {"path": poses, "legs": (duration,)}


def _thesis(path: HeldPath, quick: bool) -> list[TensionTrial]:
    duration = 1.0 if quick else THESIS_DURATION
    way = _straight(path.start, path.end, THESIS_DURATION)

    def spec(method: str, gain: float, applied: Applied = Applied.HELD) -> TensionTrial:
        return TensionTrial(
            experiment="thesis",
            robot=THESIS_ROBOT,
            **way,
            method=method,
            stiffness=gain,
            damping=gain,
            duration=duration,
            applied=applied,
        )

    specs = []
    for method, gains in THESIS_GAINS.items():
        for gain in gains[:1] if quick else gains:
            specs.append(spec(method, gain))
            if method in UNCHECKED:
                specs += [spec(method, gain, how) for how in (Applied.CUT, Applied.PUSHED)]
    if not quick:
        specs += [spec(method, 100.0) for method in ("improved_closed_form", "barycenter")]
    return specs


def _printed(ends: tuple[np.ndarray, np.ndarray], quick: bool) -> list[TensionTrial]:
    way = _straight(*ends, THESIS_DURATION)
    return [
        TensionTrial(
            experiment="printed",
            robot=THESIS_ROBOT,
            **way,
            method=method,
            stiffness=gain,
            damping=gain,
            duration=0.5 if quick else THESIS_DURATION,
            applied=Applied.PUSHED,
        )
        for method in UNCHECKED
        for gain in (THESIS_GAINS[method][:1] if quick else THESIS_GAINS[method])
    ]


def _step() -> list[TensionTrial]:
    home = load_robot(THESIS_ROBOT).home.position
    return [
        TensionTrial(
            experiment=experiment,
            robot=THESIS_ROBOT,
            **_straight(home, home, 1.0),
            method=method,
            stiffness=gain,
            damping=gain,
            duration=8.0,
            offset=(0.0, 0.0, -below),
        )
        for experiment, below in STEPS_BELOW.items()
        for method in ("linear_program", "quadratic_program")
        for gain in THESIS_GAINS[method]
    ]


def _slow(path: HeldPath) -> list[TensionTrial]:
    return [
        TensionTrial(
            experiment="slow",
            robot=THESIS_ROBOT,
            **_straight(path.start, path.end, THESIS_DURATION),
            method="quadratic_program",
            stiffness=gain,
            damping=gain,
            duration=20.0,
            rate=100.0,
        )
        for gain in THESIS_GAINS["quadratic_program"]
    ]


def _acrobot(quick: bool) -> list[TensionTrial]:
    robot = load_robot(OTHER_ROBOT)
    home = robot.home.transform()
    away = pose_from_angles(
        home.translation() + np.array([0.2, -0.15, 0.25]), np.radians([4.0, -3.0, 6.0])
    )
    leg = 2.0
    methods = applicable_methods(tension_problem(robot, home))
    if quick:
        methods = ["quadratic_program", "improved_closed_form"]
    return [
        TensionTrial(
            experiment="acrobot",
            robot=OTHER_ROBOT,
            path=(home, away, home),
            legs=(leg, leg),
            method=method,
            stiffness=100.0,
            damping=20.0,
            duration=0.5 if quick else 2.0 * leg + 0.5,
        )
        for method in methods
    ]


START_ERROR, ONE_STEP = "start_error", "one_step"
"""Names of the experiments."""

START_EXPERIMENTS = {
    START_ERROR: "The thesis' path, from a start beside it, towards the place of launch.",
    ONE_STEP: "Forces that act for 1 ms of 10 ms, as the public code sets them; three rows.",
}
"""What they are, by name."""

ERRORS = (0.3, 0.4, 0.5, 0.6)
"""Start errors, from printed tensions over gains [m]."""

LAUNCH, ON_PATH = "launch", "path"
"""Starts that leave nothing to choose: where the robot is launched, and where the path starts."""

RATES = (1000.0, 100.0)
"""A step of Gazebo, and the publisher of the public code [Hz]."""

GAINS = (100.0, 800.0, 1200.0)
"""Gains Kp at which largest tensions are printed [1/s^2]."""

PRINTED = {
    "linear_program": (54.0, 456.0, 1224.0),
    "quadratic_program": (32.0, 110.0, 342.0),
    "pseudo_inverse": (117.0, 117.0, 117.0),
    "closed_form": (267.0, 385.0, 517.0),
}
"""Largest tension by method at these gains [N]. Source: Gazebo thesis 6.4.1 to 6.4.4."""

QUICK_ERROR, QUICK_TIME = 0.5, 1.0
"""What the short form shows [m, s]."""


def error_name(error: float) -> str:
    """Words for a start that is so far from the path's [m]."""
    return f"{error:g} m"


STARTS = (*map(error_name, ERRORS), LAUNCH)
"""Where the platform starts in the experiment `START_ERROR`."""


def start_trials(quick: bool) -> list[StartTrial]:
    """All runs of both experiments, or a few short ones."""
    combinations = [
        (start, rate, balance) for start in STARTS for rate in RATES for balance in (WRENCH, FORCE)
    ]
    pulses = [(start, between) for start in (ON_PATH, LAUNCH) for between in (NOTHING, STATIC)]
    gains: tuple[float, ...] = GAINS
    if quick:
        combinations = [(error_name(QUICK_ERROR), RATES[-1], one) for one in (WRENCH, FORCE)]
        pulses, gains = [(ON_PATH, NOTHING)], GAINS[:1]
    places = {method: _Places(path_of(method)) for method in PRINTED}  # once: they ask the robot
    return [
        _trial(
            START_ERROR, method, gain, *combination,
            between="", quick=quick, places=places[method],
        )
        for combination in combinations
        for method, gain in product(PRINTED, gains)
    ] + [
        _trial(
            ONE_STEP, method, gain, start, RATES[-1],
            balance=FORCE, between=between, quick=quick, places=places[method],
        )
        for start, between in pulses
        for method, gain in product(PRINTED, gains)
    ]  # fmt: skip


class _Places:
    """Where runs of a method start.

    Attributes:
        path: Start and end of the path of Po, shape (3,) each [m].
    """

    def __init__(self, path: tuple[Array, Array]) -> None:
        self.path = path
        self._launch = np.array(load_robot(THESIS_ROBOT).home.position, float)

    def of(self, start: str) -> Array:
        """Where Po starts, shape (3,) [m]."""
        if start == LAUNCH:
            return self._launch.copy()
        error = 0.0 if start == ON_PATH else ERRORS[STARTS.index(start)]
        begins = self.path[0]
        way = self._launch - begins
        return np.asarray(begins + error * way / np.linalg.norm(way))


def path_of(method: str) -> tuple[Array, Array]:
    """Start and end of the path of Po that a method follows, shape (3,) each [m]."""
    if method in UNCHECKED:
        return printed_ends()
    moved = thesis_path()
    return moved.start, moved.end


def _trial(
    experiment: str, method: str, gain: float, start: str, rate: float, balance: str,
    *, between: str, quick: bool, places: _Places,
) -> StartTrial:  # fmt: skip
    return StartTrial(
        experiment=experiment,
        robot=THESIS_ROBOT,
        path=(places.path[0].copy(), places.path[1].copy()),
        leg=THESIS_DURATION,
        method=method,
        gain=gain,
        applied=Applied.PUSHED if method in UNCHECKED else Applied.HELD,
        balance=balance,
        rate=rate,
        start=start,
        position=places.of(start),
        duration=QUICK_TIME if quick else THESIS_DURATION,
        between=between,
    )


TURNS_DEG = ((0.0, 0.0, 0.0), (5.0, -5.0, 10.0))
"""Angles of the platform at every position of the grid [deg]."""

TIMED = 50
"""Feasible poses over which a method is timed."""

TRUTH = "linear_program"
"""The method whose verdict counts."""


def grid_problems(robot_name: str, counts: tuple[int, int, int]) -> list[TensionProblem]:
    """The problems of holding still at the poses of a grid that fills the robot's frame.

    A planar robot keeps to its plane, and turns about z only.

    Args:
        robot_name: Name of the robot.
        counts: Positions along x, y and z.
    """
    robot = load_robot(robot_name)
    # Cells' middles, so that no position lies on the frame.
    axes = [
        low + (np.arange(count) + 0.5) * (high - low) / count
        for low, high, count in zip(robot.frame.lower, robot.frame.upper, counts, strict=True)
    ]
    turns, cables = np.radians(TURNS_DEG), robot.cable_set(pulleys=False)
    if robot.is_planar():
        axes[2] = robot.home.transform().translation()[2:]
        turns[:, :2] = 0.0
    problems = []
    for turn in turns:
        for place in np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3):
            try:
                X_WP = pose_from_angles(place, turn)
                problems.append(tension_problem(robot, X_WP, cables=cables))
            except TensionProblemError:  # W is singular
                continue
    return problems


def cover(robot_name: str, counts: tuple[int, int, int], method: str) -> dict[str, Any]:
    """A method on a grid.

    Returns:
        poses of the grid; feasible: that can be held, by the linear program; solved: of these by
        the method, and their share; wrong: poses where the method's verdict on existence
        contradicts the linear program; mean_largest_tension_n: over the solved poses; call_us: one
        call of `distribute` with its checks, on feasible poses, the median; kernel_us: one pose of
        the batch form on one core.
    """
    problems = grid_problems(robot_name, counts)
    truth = np.array([distribute(p, TRUTH).status == TensionStatus.FEASIBLE for p in problems])
    feasible = [p for p, good in zip(problems, truth, strict=True) if good]
    solutions = [distribute(p, method) for p in problems]
    solved = np.array([s.status == TensionStatus.FEASIBLE for s in solutions])
    said = np.array([s.status != TensionStatus.INFEASIBLE for s in solutions])
    largest = [float(np.max(s.tensions)) for s, good in zip(solutions, solved, strict=True) if good]
    found = int(np.sum(solved & truth))
    return {
        "poses": len(problems), "feasible": len(feasible), "solved": found,
        "share": found / max(len(feasible), 1), "wrong": int(np.sum(said != truth)),
        "mean_largest_tension_n": float(np.mean(largest)) if largest else None,
        **_times(method, feasible[:TIMED]),
    }  # fmt: skip


def _times(method: str, problems: list[TensionProblem]) -> dict[str, Any]:
    """Times of one call of `distribute`, and of one pose of the batch form."""
    if not problems:
        return {"call_us": None, "kernel_us": None}
    W = np.array([p.W for p in problems])
    w = np.array([p.wrench for p in problems])
    low, high = problems[0].lower, problems[0].upper
    works: list[Callable[[], float]] = [
        lambda: seconds_each(problems, lambda p: distribute(p, method)),
        lambda: seconds_per_call(lambda: distribute_batch(W, w, low, high, method, threads=1), 5),
    ]
    # A method that needs long has no use for many repeats.
    single, batch = interleaved(works, 1 if works[0]() * len(problems) > 0.3 else 5)
    return {"call_us": 1e6 * single, "kernel_us": 1e6 * batch / len(problems)}
