"""Which single breaks of a cable a platform survives, and by which reaction, from one pose.

Every single cable breaks while the platform stands at a pose, or passes it at a speed, and every
reaction follows, told at once. All of them start from the same state and are
moved together by `BatchRobots`; the controller of motor torques is the law that `TorqueController`
calls, with what it reads known without error, and reactions act at the instants at which
`EmergencyReaction` and `TorqueController` act in a diagram.

A reaction saves the platform where no anchor point leaves the frame or goes into the ground, and
the platform is at rest in the end, see `runs.breaks`. Of a cable that reaction is best that saves
it and goes least far; where none does, that which goes least far.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.runs.breaks import (
    BRAKE,
    BRAKING,
    DEFAULT_SAVING,
    DESCEND,
    RESTS,
    RETREAT,
    SAVING,
    STOP,
    leaves,
)
from cdpr_drake.arrays import Array
from cdpr_drake.control.torque_law import EMERGENCY, TorqueServoLaw
from cdpr_drake.errors import (
    CableGeometryError,
    InfeasibleTensionError,
    TensionProblemError,
    WorkspaceError,
)
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.typed_yaml import closest
from cdpr_drake.servoing.servo_task import BelievedRobot
from cdpr_drake.systems.batches.batch_robots import BatchRobots, BatchState
from cdpr_drake.systems.controllers.break_reactions import (
    ReactionRule,
    WaysOut,
    descent_twist,
    retreat_twist,
    ways_out,
)
from cdpr_drake.systems.controllers.torque_settings import TORQUE, TorqueControl
from cdpr_drake.systems.diagrams.torque_control import torque_law
from cdpr_drake.systems.robots.cable_robot import automatic_step
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.settings import CableRobotSettings
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.tensions.methods import method_for
from cdpr_drake.winches.failed_winches import HOLD

RULES = {name: ReactionRule(name, delay=BRAKE if name == STOP else 0.0) for name in SAVING}
"""What is done by each reaction."""

SETTLES = 0.3
"""For how long the platform stands before a break, so that tensions are those of the law [s]."""

FASTEST = 100.0
"""Largest component of a velocity that is accepted [m/s]: no platform on cables is so fast."""

SETS_OUT = 0.4
"""For how long it flies at its speed, about, before it passes the pose [s]."""

CALM = 0.1
"""For how long it must be at rest in the end [s]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class BreakRequest:
    """What breaks lead to.

    Attributes:
        scenario: Whose sections cables, winches, damping, torque_control and integration count.
        reactions: Names of `SAVING`.
        velocity: Of Po in W when the cable breaks, shape (3,) [m/s].
        after: For how long it is looked at after that [s].
        limits: Smallest and largest tension that the controller asks for [N]; None: the scenario's,
            or those of a robot that is not the scenario's.
    """

    scenario: Scenario
    reactions: tuple[str, ...] = DEFAULT_SAVING
    velocity: Array
    after: float = 2.0
    limits: tuple[float, float] | None = None

    def torque_control(self, robot: Robot) -> TorqueControl:
        """Its controller of torques: of another robot than the scenario's, limits and method of
        tensions, which belong to a robot, are the robot's and the default."""
        settings = self.scenario.torque_control or TorqueControl()
        if self.limits is not None:
            settings = replace(settings, limits=np.array(self.limits))
        if robot.name == load_robot(self.scenario.robot).name:
            return settings
        own = settings.limits if self.limits is not None else None
        return replace(settings, limits=own, method=TorqueControl().method)

    def check(self, robot: Robot) -> None:
        """Refuses what is not possible.

        Raises:
            WorkspaceError: Names it.
        """
        for name in self.reactions:
            if name not in SAVING:
                raise WorkspaceError(f"reactions {name!r} is unknown; {closest(name, SAVING)}")
        if not self.reactions:
            raise WorkspaceError(f"reactions: found none; accepted: {', '.join(SAVING)}")
        if not CALM < self.after < np.inf:
            raise WorkspaceError(
                f"after: found {self.after:g}; accepted: a number above {CALM:g} [s]"
            )
        moving = np.asarray(self.velocity, float)
        if moving.shape != (3,) or not np.all(np.abs(moving) <= FASTEST):  # also NaN
            raise WorkspaceError(
                f"moving: found {np.ravel(moving).tolist()}; accepted: three finite numbers, of at "
                f"most {FASTEST:g} m/s"
            )
        if self.scenario.winches.mode != TORQUE:
            raise WorkspaceError(
                f"scenario {self.scenario.name}: winches.mode: found "
                f"{self.scenario.winches.mode}; accepted for the kind dynamic-single-failure: "
                f"{TORQUE}"
            )
        if robot.winch_groups().are_shared():
            raise WorkspaceError(
                f"kind dynamic-single-failure: found {robot.name}, which has several cables on one "
                "winch; accepted: robots with a winch for each cable"
            )
        if not robot.joint().is_floating:
            raise WorkspaceError(
                f"kind dynamic-single-failure: found {robot.name}, whose platform does not move "
                "freely; accepted: robots with six degrees of freedom"
            )
        settings, spare = self.torque_control(robot), len(robot.cables) - 6
        try:
            for name in (settings.method, EMERGENCY):
                method_for(name, spare, False)
        except TensionProblemError as problem:
            raise WorkspaceError(
                f"kind dynamic-single-failure: {robot.name}: {problem}"
            ) from problem


@dataclass(frozen=True, eq=False)
class BreakOutcomes:
    """What became of a platform, by cable that broke and reaction, arrays of shape (m, k).

    Attributes:
        reactions: Names of the k reactions.
        excursion: Largest distance of Po from where it was [m].
        fastest: Largest speed of Po [m/s].
        tension: Largest tension [N].
        leaves: Whether an anchor point left the frame or went into the ground.
        rests: Whether the platform is at rest in the end.
    """

    reactions: tuple[str, ...]
    excursion: Array
    fastest: Array
    tension: Array
    leaves: np.ndarray
    rests: np.ndarray

    @property
    def saved(self) -> np.ndarray:
        """Whether the reaction saves the platform, shape (m, k)."""
        return self.rests & ~self.leaves & np.isfinite(self.excursion)

    def best(self) -> np.ndarray:
        """Number of the best reaction to each cable's break, shape (m,)."""
        far = np.where(np.isfinite(self.excursion), self.excursion, np.inf)
        saving = np.where(self.saved, far, np.inf)
        some = np.any(self.saved, axis=1)
        return np.where(some, np.argmin(saving, axis=1), np.argmin(far, axis=1))

    def worst(self) -> tuple[int, int, float, bool]:
        """The cable whose break is worst, the best reaction to it, how far that goes [m], and
        whether there is one that saves the platform for each cable."""
        best, rows = self.best(), np.arange(len(self.excursion))
        saved, far = self.saved[rows, best], self.excursion[rows, best]
        shown = np.where(np.isfinite(far), far, np.inf)
        cable = int(np.lexsort((-shown, saved))[0])
        return cable, int(best[cable]), float(far[cable]), bool(np.all(saved))


def breaks_at(robot: Robot, X_WP: RigidTransform, asked: BreakRequest) -> BreakOutcomes | None:
    """What follows the break of every single cable at a pose; None where all cables cannot hold it.

    Args:
        robot: The robot.
        X_WP: Pose of the platform [m].
        asked: What breaks lead to; checked.

    Raises:
        RobotFileError: The robot's file does not say enough of its motors.
    """
    hung = _Hung(robot, asked)
    try:
        state = hung.fly_to(X_WP)
    except (InfeasibleTensionError, CableGeometryError, TensionProblemError):
        return None  # a pose outside the frame, too
    return None if state is None else hung.break_all(state)


@dataclass(frozen=True, eq=False)
class _Moment:
    """Where a run stands: states of all robots, and the memory of the law."""

    state: BatchState
    memory: Array


class _Hung:
    """A robot under its controller of torques, on the way to a pose."""

    def __init__(self, robot: Robot, asked: BreakRequest) -> None:
        scenario, self._asked, self._robot = asked.scenario, asked, robot
        settings = asked.torque_control(robot)
        self._believed = scenario.cables.cable_set(robot)
        # Brakes of a reaction hold in a diagram whatever the file says of one, and do not slip.
        self._braked = replace(robot, winch=replace(robot.winch, brake_torque=HOLD))
        self._most = settings.wanted_limits(robot)[1]
        # Without a camera: the law reads its cables alone.
        believed = BelievedRobot(self._believed, RigidTransform(), robot.home.transform())
        self._law = torque_law(settings, robot, believed, scenario)
        self._period = 1.0 / settings.rate
        self._simulated = CableRobotSettings(
            cables=scenario.cables, winches=scenario.winches, damping=scenario.damping
        )
        self._velocity = np.asarray(asked.velocity, float)
        self._lead = SETS_OUT if np.any(self._velocity) else 0.0
        self._rule = StepRule()

    def _robots(self, count: int) -> BatchRobots:
        return BatchRobots(
            self._braked, count, settings=self._simulated, rule=self._rule, threads=1
        )

    def fly_to(self, X_WP: RigidTransform) -> _Moment | None:
        """Lets it settle, and fly until it passes the pose, which takes no longer than twice as
        long as at its speed; None where its cables do not hold it."""
        integration = self._asked.scenario.integration
        method, step = integration.integrator, integration.max_step
        if step is None:
            step = automatic_step(self._braked, X_WP, method, self._simulated)
        self._rule = StepRule(
            method=method, max_step=min(step, self._period), accuracy=integration.accuracy
        )
        one, memory = self._robots(1), self._law.fresh_memory()
        start = X_WP.translation() - self._lead * self._velocity
        one.reset(poses=[RigidTransform(X_WP.rotation(), start)])
        steps = round(SETTLES / self._period)
        for k in range(steps + round(2.0 * self._lead / self._period)):
            seen, wanted = _Seen(one), np.zeros(6)
            here = pose_from_row(seen.poses[0])
            if k >= steps:
                if self._velocity @ (X_WP.translation() - here.translation()) <= 0.0:
                    break
                wanted[3:] = here.rotation().matrix().T @ self._velocity
            torques, memory = _ask(self._law, seen, 0, memory, wanted, k * self._period)
            one.step(torques, self._period)
        return None if one.failed[0] else _Moment(one.save_state(), memory)

    def break_all(self, at: _Moment) -> BreakOutcomes:
        """Breaks every cable once for each reaction, from the same moment."""
        m, names = len(self._robot.cables), self._asked.reactions
        pairs = [(cable, name) for cable in range(m) for name in names]
        many = self._robots(len(pairs))
        many.load_state(
            BatchState(tuple(np.repeat(one, len(pairs), axis=0) for one in at.state.arrays))
        )
        for row, (cable, _) in enumerate(pairs):
            many.break_cable([row], cable)
        ways = {
            name: ways_out(RULES[name], self._robot, self._believed, self._most) for name in names
        }
        runs = [
            _Reacting(self._law, RULES[name], cable, at, ways[name], self._velocity)
            for cable, name in pairs
        ]
        rows = self._rows(many, runs)
        far, fast, out, rest = (np.array(column) for column in zip(*(
            _judged(self._robot, rows.poses[:, row], rows.twists[:, row], self._period)
            for row in range(len(pairs))
        ), strict=True))  # fmt: skip
        gone, shape = many.failed, (m, len(names))
        far, fast = (np.where(gone, np.nan, column).reshape(shape) for column in (far, fast))
        return BreakOutcomes(
            names, far, fast, rows.tension.reshape(shape), (out | gone).reshape(shape),
            (rest & ~gone).reshape(shape),
        )  # fmt: skip

    def _rows(self, many: BatchRobots, runs: Sequence[_Reacting]) -> _Rows:
        """Moves all robots on, each with its reaction."""
        steps = round(self._asked.after / self._period)
        begin, shape = float(many.times[0]), (len(runs), many.cables)
        rows = _Rows(
            np.empty((steps + 1, len(runs), 7)), np.empty((steps + 1, len(runs), 6)),
            np.zeros(len(runs)),
        )  # fmt: skip
        commands, brakes = np.empty(shape), np.empty(shape)
        tension = rows.tension
        for k in range(steps + 1):
            seen, since = _Seen(many), k * self._period
            rows.poses[k], rows.twists[k] = many.poses, many.twists
            np.fmax(tension, np.max(seen.tensions, axis=1), out=tension)
            if k == steps:
                break
            for row, run in enumerate(runs):
                commands[row], brakes[row] = run.step(seen, row, since, begin + since)
            many.step(commands, self._period, brakes=brakes)
        return rows


@dataclass(frozen=True, eq=False)
class _Rows:
    """What robots did at the instants of control, from the break on.

    Attributes:
        poses: Shape (n, robots, 7).
        twists: Shape (n, robots, 6) [rad/s, m/s].
        tension: Largest tension of each, shape (robots,) [N].
    """

    poses: Array
    twists: Array
    tension: Array


class _Seen:
    """What is read of all robots at an instant, without error."""

    def __init__(self, robots: BatchRobots) -> None:
        m, states = robots.cables, robots.states
        self.poses, self.tensions = states[:, :7], robots.tensions
        self.rates = states[:, -m:]  # of motors by torque nothing comes behind them


def _ask(
    law: TorqueServoLaw, seen: _Seen, row: int, memory: Array, wanted: Array, time: float
) -> tuple[Array, Array]:
    """Torques that the law asks of a robot's motors, shape (m,) [N m], and its memory."""
    readings = np.array([seen.tensions[row], seen.rates[row]])
    command, memory = law.step(memory, wanted, pose_from_row(seen.poses[row]), readings, time)
    return command.torques, memory


class _Reacting:
    """The controller of one robot after a break, at the instants of `EmergencyReaction`.

    It is told at its first look, when the cable breaks; what it decides at a look the brakes do
    from then on, and the controller of torques one of its own steps later.
    """

    def __init__(
        self, law: TorqueServoLaw, rule: ReactionRule, cable: int, at: _Moment,
        ways: WaysOut, velocity: Array,
    ) -> None:  # fmt: skip
        self._rule, self._cable, self._ways, self._velocity = rule, cable, ways, velocity
        self._broken = np.arange(law.cable_count) == cable
        self._before = law
        self._after = law.without(self._broken, braking=rule.reaction == BRAKING)
        self._memory, self._twist = at.memory, np.zeros(6)
        self._goal: RigidTransform | None = None
        self._acts = self._halts = False
        self._look = -1

    def step(self, seen: _Seen, row: int, since: float, time: float) -> tuple[Array, Array]:
        """Torques, shape (m,) [N m], and flags of brakes, shape (m,), from now on.

        Args:
            seen: What is read.
            row: Which robot it is.
            since: Time since the break [s].
            time: Time of its controller [s].
        """
        rule, X_WP = self._rule, pose_from_row(seen.poses[row])
        law, wanted = self._before, np.zeros(6)
        if self._acts and rule.reaction != STOP:
            law, wanted = self._after, self._twist
        else:
            wanted[3:] = X_WP.rotation().matrix().T @ self._velocity
        torques, self._memory = _ask(law, seen, row, self._memory, wanted, time)
        look = int(np.floor(since * rule.rate * (1.0 + 1e-12) + 1e-9))
        if look > self._look:
            self._look = look
            self._acts = rule.delay <= since * (1.0 + 1e-12)
            if self._acts:
                self._twist = self._out(X_WP)
        if not self._acts:
            return torques, np.zeros(len(torques))
        return torques, np.where(self._broken | (rule.reaction == STOP), 1.0, 0.0)

    def _out(self, X_WP: RigidTransform) -> Array:
        """Twist that is wanted, shape (6,) [rad/s, m/s]."""
        rule, ways = self._rule, self._ways
        if rule.reaction == DESCEND:
            return descent_twist(X_WP, ways.anchors, ways.ground, rule)
        if rule.reaction != RETREAT:
            return np.zeros(6)
        if self._goal is None:
            self._goal = ways.held(X_WP, self._broken.astype(float))
        return retreat_twist(X_WP, self._goal, rule.speed, ways.size)


def _judged(
    robot: Robot, poses: Array, twists: Array, period: float
) -> tuple[float, float, bool, bool]:
    """Excursion [m], largest speed [m/s], whether an anchor point left the frame, whether it rests.

    Args:
        robot: The robot.
        poses: Rows of poses, shape (n, 7).
        twists: Angular velocities and velocities then, shape (n, 6) [rad/s, m/s].
        period: Between them [s].
    """
    distance = np.linalg.norm(poses[:, 4:] - poses[0, 4:], axis=1)
    speed, turning = (np.linalg.norm(twists[:, part], axis=1) for part in (slice(3, 6), slice(3)))
    end = slice(-max(round(CALM / period), 1), None)
    rests = np.all(speed[end] <= RESTS[0]) and np.all(turning[end] <= RESTS[1])
    out = leaves(robot, poses)
    return float(np.max(distance)), float(np.max(speed)), bool(np.any(out)), bool(rests)
