"""Trials of the study of tension methods: what is simulated, and its numbers.

Trials of the thesis' path go by Drake's simulator, recorded in each step; those that start beside
it by compiled steps, without a diagram where the block is a `TensionDistributor`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from functools import cache, partial
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiscreteValues, EventStatus

from cdpr_drake.analyses.reporting.timing import interleaved, seconds_each, seconds_per_call
from cdpr_drake.analyses.runs.engine import fixed_step_simulator
from cdpr_drake.analyses.runs.run import PIECE
from cdpr_drake.analyses.tensions import applicable_methods
from cdpr_drake.arrays import Array
from cdpr_drake.control.force_balance import FORCE, WRENCH, force_problem
from cdpr_drake.control.task_space import TaskGains
from cdpr_drake.errors import (
    CableGeometryError,
    DivergedError,
    InfeasibleTensionError,
    TensionProblemError,
)
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

    def build(self) -> TensionControl:
        """The diagram."""
        held = self.applied == Applied.HELD
        settings = TensionControlSettings(
            trajectory=PoseTrajectory(self.path, self.legs),
            gains=TaskGains(self.stiffness, self.damping),
            method=self.method,
            rate=self.rate,
            push=self.applied == Applied.PUSHED,
            distributor=TensionDistributor if held else UncheckedDistributor,
        )
        return build_tension_control(load_robot(self.robot), settings)


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
        start = control.trajectory.pose(0.0)
        start.set_translation(start.translation() + spec.offset)
        control.set_pose(context, start)
    plant, platform = control.in_plant.plant, control.in_plant.model_instance
    plant_context = plant.GetMyContextFromRoot(context)
    most, steps = round(spec.duration / STEP) + 2, list[Array]()

    def lost() -> bool:
        return bool(steps) and not steps[-1][1] < LOST_DISTANCE

    def record(context: Context) -> EventStatus:
        """Keeps time, error and tensions of a step, and ends a run that is lost."""
        now = context.get_time()
        if now == 0.0 or len(steps) == most:  # before the first control step
            return EventStatus.DidNothing()
        place = plant.GetPositions(plant_context, platform)[4:7]
        away = place - control.trajectory.motion(now)[4:7]
        tensions = control.diagram.GetOutputPort("tensions").Eval(context)
        steps.append(np.array([now, np.sqrt(away @ away), *tensions]))
        return EventStatus.ReachedTermination(None, "lost") if lost() else EventStatus.DidNothing()

    simulator = fixed_step_simulator(control.diagram, context, "runge_kutta3", STEP)
    simulator.set_monitor(record)
    diverged = False
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            while not (diverged := lost()) and context.get_time() < spec.duration * (1.0 - 1e-9):
                simulator.AdvanceTo(min(context.get_time() + PIECE, spec.duration))
    except (CableGeometryError, DivergedError):
        diverged = True
    except RuntimeError as problem:  # Drake refuses NaN
        if "NaN" not in str(problem):
            raise
        diverged = True
    rows = np.array(steps)
    times, errors_m, tensions_n = rows[:, 0], rows[:, 1], rows[:, 2:]
    chosen = tensions_n[:: max(1, round(1.0 / (spec.rate * STEP)))]  # of each control step
    some = slice(None, None, max(1, len(times) // KEPT_ROWS))
    return {
        "kd_per_s": spec.damping, "control_rate_hz": spec.rate, "start_offset_m": spec.offset,
        "wanted_duration_s": spec.duration, "end_time_s": times[-1],
        "lost": diverged,
        "position_error_max_m": np.max(errors_m), "position_error_mean_m": np.mean(errors_m),
        "position_error_last_tenth_m": np.mean(errors_m[-max(1, len(errors_m) // 10) :]),
        "tension_max_n": np.max(tensions_n), "tension_min_n": np.min(tensions_n),
        "tension_jump_max_n": np.max(np.abs(np.diff(chosen, axis=0)), initial=0.0),
        "negative_tensions": int(np.sum(chosen < 0.0)),
        "failures": int(control.diagram.GetOutputPort("failures").Eval(context)[0]),
        "control_steps": len(chosen), "times_s": times[some].copy(),
        "errors_m": errors_m[some].copy(), "tensions_n": tensions_n[some].copy(),
    }  # fmt: skip


LOOK = 1.0
"""Time between looks at whether the platform is lost [s]."""

PULSE_RATE = 1.0 / STEP
"""Steps of Gazebo per second; forces that are set for one act so long [Hz]."""

NOTHING, STATIC = "nothing", "tensions of rest"
"""What acts between steps in which commanded forces do; the second acts in these too."""


class PulsedDistributor(UncheckedDistributor):
    """An `UncheckedDistributor` whose tensions act for one step of Gazebo at each control step.

    Ports are those of `TensionDistributor`, but tensions are those that act; it is called once in
    every step of Gazebo. Where its method has no answer it asks for the lower limits.
    """

    def __init__(self, *settings: Any, every: int, between: Array, **options: Any) -> None:
        """Arguments as of `TensionDistributor`; beside them steps of Gazebo in a control step, and
        tensions that act between, shape (m,) [N]."""
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
    """What to simulate, beside a straight path; see `TensionTrial` for other attributes.

    Attributes:
        path: Where the path of Po starts and ends, shape (2, 3) [m].
        leg: Time that it takes [s].
        gain: Kp [1/s^2] and Kd [1/s].
        balance: A name of `force_balance.BALANCES`.
        start: Words for where the platform starts.
        position: That place of Po, shape (3,) [m].
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

    def build(self) -> TensionControl:
        """The diagram."""
        robot = load_robot(self.robot)
        held = self.applied == Applied.HELD
        distributor: Any = TensionDistributor if held else UncheckedDistributor
        if self.between:
            every, tensions = round(PULSE_RATE / self.rate), self.resting_tensions(robot)
            distributor = partial(PulsedDistributor, every=every, between=tensions)
        settings = TensionControlSettings(
            trajectory=PoseTrajectory(
                tuple(pose_from_angles(p, np.zeros(3)) for p in self.path), (self.leg,)
            ),
            gains=TaskGains(self.gain, self.gain),
            method=self.method,
            rate=PULSE_RATE if self.between else self.rate,
            balance=self.balance,
            push=self.applied == Applied.PUSHED,
            distributor=distributor,
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
    start_error = float(np.linalg.norm(spec.position - spec.path[0]))
    advance_to: Callable[[float], Any]
    errors: Callable[[], tuple[float, float]]
    if can_be_compiled(control):
        loop = TensionLoop(control, spec.rate, start)
        advance_to, errors, columns = loop.advance_to, loop.errors, loop.columns
    else:
        assert control.log is not None
        context = control.make_context()
        control.set_pose(context, start)
        simulator = Simulator(control.diagram, context)
        simulator.Initialize()
        advance_to, errors = simulator.AdvanceTo, partial(control.errors, context)
        columns = partial(control.log.read, context)
    lost, time = False, 0.0
    while time < spec.duration and not lost:
        time = min(time + LOOK, spec.duration)
        try:
            advance_to(time)
            lost = not errors()[0] < LOST_DISTANCE + start_error
        except DivergedError:
            lost = True
    log = columns()
    times, states, tensions = log["time"], log["platform_state"], log["tensions"]
    # A row stands before the control step of its time: the next one has what this step asked for.
    asked = tensions[1:]
    if spec.between:
        resting = spec.resting_tensions(control.robot)
        asked = asked[:: round(PULSE_RATE / spec.rate)] - resting
    tenth = slice(-max(1, len(times) // 10), None)
    where = np.array([control.trajectory.motion(time)[4:7] for time in times[tenth]])
    away = np.linalg.norm(states[tenth, 4:7] - where, axis=1)
    q = states[:, :4] / np.linalg.norm(states[:, :4], axis=1)[:, np.newaxis]
    return {
        "start_error_m": start_error, "wanted_duration_s": spec.duration,
        "end_time_s": times[-1], "lost": lost,
        "tension_max_n": np.max(asked), "tension_min_n": np.min(asked),
        "tension_first_max_n": np.max(asked[0]),
        "tension_last_max_n": None if lost else np.max(asked[round(0.5 * len(asked)) :]),
        "turn_max_rad": 2.0 * np.max(np.arctan2(np.linalg.norm(q[:, 1:], axis=1), np.abs(q[:, 0]))),
        "position_error_last_tenth_m": np.mean(away),
        "failures": int(log["failures"][-1, 0]), "control_steps": len(asked),
    }  # fmt: skip


PATH_STEPS = 1000
"""Poses of a straight path that are tried, beside its end."""

FINE = 1e-6
"""How closely the least shift is found [m]."""

MARGIN = 0.01
"""What an end moves beyond its limit, if it has to move at all: at the limit itself no tensions are
left to control with [m]."""


class HeldPath(NamedTuple):
    """A straight path of Po that the robot holds everywhere, and what was changed for it.

    Attributes:
        ends: Where it starts and ends, shape (3,) each [m].
        limits: Least distances by which these had to move towards the inside [m].
        shifts: Distances by which they moved [m].
    """

    ends: tuple[Array, Array]
    limits: tuple[float, float]
    shifts: tuple[float, float]


def can_hold(robot: Robot, position: Array) -> bool:
    """Whether tensions hold the unturned platform at rest with Po at a position [m]; exact."""
    X_WP = pose_from_angles(position, np.zeros(3))
    cables = robot.cable_set(pulleys=False)  # as in the theses
    return exact_tensions(tension_problem(robot, X_WP, cables=cables)) is not None


def held_path(robot: Robot, start: Array, end: Array, inside: Array) -> HeldPath:
    """Moves each end straight towards the inside until it and then the path between can be held.

    Args:
        robot: The robot.
        start: Wanted start of Po, unturned platform, shape (3,) [m].
        end: Wanted end, shape (3,) [m].
        inside: A position that can be held, shape (3,) [m].

    Raises:
        InfeasibleTensionError: The inside cannot be held, or no such path was found.
    """
    wanted, inside = np.array([start, end], float), np.asarray(inside, float)
    if not can_hold(robot, inside):
        raise InfeasibleTensionError(f"{robot.name}: no tensions hold the platform at {inside}")
    ways = inside - wanted
    lengths = [float(np.linalg.norm(way)) for way in ways]

    def moved(which: int, shift: float) -> Array:
        length = lengths[which]
        return wanted[which] + ways[which] * (min(shift / length, 1.0) if length > 0.0 else 0.0)

    def least_shift(which: int) -> float:
        if can_hold(robot, wanted[which]):
            return 0.0
        bad, good = 0.0, lengths[which]
        while good - bad > FINE:
            middle = (bad + good) / 2.0
            if can_hold(robot, moved(which, middle)):
                good = middle
            else:
                bad = middle
        return good

    limits = least_shift(0), least_shift(1)
    shifts = [limit + MARGIN if limit > 0.0 else 0.0 for limit in limits]
    while True:
        first, last = ends = moved(0, shifts[0]), moved(1, shifts[1])
        shares = np.linspace(0.0, 1.0, PATH_STEPS + 1)
        bad = [share for share in shares if not can_hold(robot, first + share * (last - first))]
        if not bad:
            return HeldPath(ends, limits, (shifts[0], shifts[1]))
        nearer = 0 if np.mean(bad) <= 0.5 else 1  # the end next to what cannot be held
        shifts[nearer] += MARGIN
        if shifts[nearer] > lengths[nearer]:
            raise InfeasibleTensionError(f"{robot.name}: found no path that can be held throughout")


THESIS_ROBOT = "caroca_gazebo"
OTHER_ROBOT = "acrobot_large"

THESIS_START = (0.0, -2.0, 2.0)
THESIS_END = (3.0, 1.0, 3.0)
"""Gazebo thesis 6.2, the middle of the platform [m]."""

THESIS_DURATION = 100.0
"""Gazebo thesis 6.2 [s]."""

PRINTED = {
    "linear_program": (54.0, 456.0, 1224.0),
    "quadratic_program": (32.0, 110.0, 342.0),
    "pseudo_inverse": (117.0, 117.0, 117.0),
    "closed_form": (267.0, 385.0, 517.0),
}
"""Largest tension by method at `GAINS` [N]. Source: Gazebo thesis 6.4.1 to 6.4.4."""

GAINS = (100.0, 800.0, 1200.0)
"""Gains Kp at which these are printed [1/s^2]."""

THESIS_GAINS = dict.fromkeys(PRINTED, GAINS) | {"quadratic_program": (*GAINS, 1500.0)}
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
    return held_path(robot, *printed_ends(), np.array(robot.home.position, float))


def printed_ends() -> tuple[Array, Array]:
    """Where the thesis' path starts and ends, shape (3,) each, of Po [m]."""
    # The thesis' platform frame lies in the middle of the box, P in the middle of its bottom.
    middle = np.array([0.0, 0.0, float(load_robot(THESIS_ROBOT).platform.size[2]) / 2.0])
    return np.array(THESIS_START) - middle, np.array(THESIS_END) - middle


def trials(quick: bool) -> list[TensionTrial]:
    """All runs, or short ones of some, in the order of the experiments."""
    ends, home = thesis_path().ends, load_robot(THESIS_ROBOT).home.position
    gains = {method: some[:1] if quick else some for method, some in THESIS_GAINS.items()}
    if not quick:
        gains |= {"improved_closed_form": (100.0,), "barycenter": (100.0,)}
    duration = 1.0 if quick else THESIS_DURATION
    specs = [
        straight_trial("thesis", ends, duration, method, gain, applied=applied)
        for method, some in gains.items()
        for gain in some
        for applied in (Applied if method in UNCHECKED else [Applied.HELD])
    ]
    specs += [
        straight_trial(
            "printed", printed_ends(), 0.5 if quick else THESIS_DURATION, method, gain,
            applied=Applied.PUSHED,
        )
        for method in UNCHECKED
        for gain in gains[method]
    ]  # fmt: skip
    if not quick:
        specs += [
            straight_trial(
                experiment, (home, home), 8.0, method, gain,
                legs=(1.0,), offset=(0.0, 0.0, -below),
            )
            for experiment, below in STEPS_BELOW.items()
            for method in ("linear_program", "quadratic_program")
            for gain in gains[method]
        ]  # fmt: skip
        specs += [
            straight_trial("slow", ends, 20.0, "quadratic_program", gain, rate=100.0)
            for gain in gains["quadratic_program"]
        ]
    return specs + acrobot_trials(quick)


def straight_trial(
    experiment: str, ends: tuple[Any, Any], duration: float, method: str, gain: float,
    legs: tuple[float, ...] = (THESIS_DURATION,), **changes: Any,
) -> TensionTrial:  # fmt: skip
    """A run of the thesis' robot along a straight path of Po [m], with Kp = Kd."""
    return TensionTrial(
        experiment=experiment, robot=THESIS_ROBOT, method=method, stiffness=gain, damping=gain,
        path=tuple(pose_from_angles(place, np.zeros(3)) for place in ends), legs=legs,
        duration=duration, **changes,
    )  # fmt: skip


def acrobot_trials(quick: bool) -> list[TensionTrial]:
    """Runs of the other robot, by every method that fits it."""
    robot = load_robot(OTHER_ROBOT)
    home = robot.home.transform()
    away = pose_from_angles(
        home.translation() + np.array([0.2, -0.15, 0.25]), np.radians([4.0, -3.0, 6.0])
    )
    methods = applicable_methods(tension_problem(robot, home))
    if quick:
        methods = ["quadratic_program", "improved_closed_form"]
    return [
        TensionTrial(
            experiment="acrobot", robot=OTHER_ROBOT, path=(home, away, home), legs=(2.0, 2.0),
            method=method, stiffness=100.0, damping=20.0, duration=0.5 if quick else 4.5,
        )
        for method in methods
    ]  # fmt: skip


START_ERROR, ONE_STEP = "start_error", "one_step"
"""Names of the experiments."""

START_EXPERIMENTS = {
    START_ERROR: "The thesis' path, from a start beside it, towards the place of launch.",
    ONE_STEP: "Forces that act for 1 ms of 10 ms, as the public code sets them; three rows.",
}
"""What they are, by name."""

LAUNCH, ON_PATH = "launch", "path"
"""Starts that leave nothing to choose: where the robot is launched, and where the path starts."""

ERRORS = {"0.3 m": 0.3, "0.4 m": 0.4, "0.5 m": 0.5, "0.6 m": 0.6}
"""Start errors towards the place of launch, from printed tensions over gains [m]."""

STARTS = (*ERRORS, LAUNCH)
"""Where the platform starts in the experiment `START_ERROR`."""

RATES = (1000.0, 100.0)
"""A step of Gazebo, and the publisher of the public code [Hz]."""


def start_trials(quick: bool) -> list[StartTrial]:
    """All runs of both experiments, or a few short ones."""
    beside = product(["0.5 m"], RATES[-1:]) if quick else product(STARTS, RATES)
    pulses = product((ON_PATH, LAUNCH), (NOTHING, STATIC))
    settings: list[dict[str, Any]] = [
        {"experiment": START_ERROR, "start": start, "rate": rate, "balance": balance}
        for (start, rate), balance in product(beside, (WRENCH, FORCE))
    ] + [
        {"experiment": ONE_STEP, "start": start, "rate": RATES[-1], "balance": FORCE,
         "between": between}
        for start, between in ([(ON_PATH, NOTHING)] if quick else pulses)
    ]  # fmt: skip
    launch = np.array(load_robot(THESIS_ROBOT).home.position, float)
    specs = []
    for setting, method in product(settings, PRINTED):
        path = printed_ends() if method in UNCHECKED else thesis_path().ends
        way, start = launch - path[0], setting["start"]
        begin = path[0] + ERRORS.get(start, 0.0) * way / np.linalg.norm(way)
        specs += [
            StartTrial(
                robot=THESIS_ROBOT, path=path, leg=THESIS_DURATION, method=method, gain=gain,
                applied=Applied.PUSHED if method in UNCHECKED else Applied.HELD,
                position=launch if start == LAUNCH else begin,
                duration=1.0 if quick else THESIS_DURATION, **setting,
            )
            for gain in (GAINS[:1] if quick else GAINS)
        ]  # fmt: skip
    return specs


TURNS_DEG = ((0.0, 0.0, 0.0), (5.0, -5.0, 10.0))
"""Angles of the platform at every position of the grid [deg]."""

TIMED = 50
"""Feasible poses over which a method is timed."""

TRUTH = "linear_program"
"""The method whose verdict counts."""


def grid_problems(
    robot: Robot, counts: tuple[int, int, int], turns_deg: Sequence[Sequence[float]] = TURNS_DEG,
    limits: tuple[float, float] | None = None,
) -> list[TensionProblem]:  # fmt: skip
    """The problems of holding still at the poses of a grid that fills the robot's frame.

    A planar robot keeps to its plane, and turns about z only.

    Args:
        robot: The robot.
        counts: Positions along x, y and z.
        turns_deg: Angles of the platform at every position [deg].
        limits: Smallest and largest tension [N]; None: the robot's.
    """
    # Cells' middles, so that no position lies on the frame.
    axes = [
        low + (np.arange(count) + 0.5) * (high - low) / count
        for low, high, count in zip(robot.frame.lower, robot.frame.upper, counts, strict=True)
    ]
    turns, cables = np.radians(turns_deg), robot.cable_set(pulleys=False)
    if robot.is_planar():
        axes[2] = robot.home.transform().translation()[2:]
        turns[:, :2] = 0.0
    places = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    problems = []
    for turn, place in product(turns, places):
        with suppress(TensionProblemError):  # W is singular
            X_WP = pose_from_angles(place, turn)
            problems.append(tension_problem(robot, X_WP, limits=limits, cables=cables))
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
    problems = grid_problems(load_robot(robot_name), counts)
    solutions = [distribute(p, method) for p in problems]
    truth = np.array([distribute(p, TRUTH).status for p in problems]) == TensionStatus.FEASIBLE
    said = np.array([solution.status for solution in solutions])
    solved = said == TensionStatus.FEASIBLE
    feasible = [p for p, good in zip(problems, truth, strict=True) if good]
    largest = [np.max(s.tensions) for s in solutions if s.status == TensionStatus.FEASIBLE]
    found = int(np.sum(solved & truth))
    return {
        "poses": len(problems), "feasible": len(feasible), "solved": found,
        "share": found / max(len(feasible), 1),
        "wrong": int(np.sum((said != TensionStatus.INFEASIBLE) != truth)),
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
