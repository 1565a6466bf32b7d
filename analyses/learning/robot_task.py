"""A task for one robot or many: episodes, actions, observations and rewards in arrays."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody

from cdpr_drake.analyses.learning.held_box import HeldBox
from cdpr_drake.analyses.learning.task_kernel import (
    PLATFORM,
    take_costs,
    write_platform,
    write_rates,
)
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError, InfeasibleTensionError, accepted_names
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_draws import ParameterCovariance, drawn_robots
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_parameters import parameter_names
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.batches.batch_member import BatchMember
from cdpr_drake.systems.batches.batch_robots import BatchRobots
from cdpr_drake.systems.robots.cable_robot import automatic_step
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.settings import CableRobotSettings, WinchSettings

RATES, TENSIONS, TWIST = "rates", "tensions", "twist"
ACTIONS = (RATES, TENSIONS, TWIST)
"""What an action commands: cable velocities, cable tensions, or the platform's twist, which the
robot that is believed turns into cable velocities."""

MOST = 10.0
"""Observations are cut at this size [-]."""

REACH_TIME = 5.0
"""Places of an episode are at most so far from home as a fifth of the speed goes in this [s]."""

REACH_SHARE, ROOM_SHARE = 0.2, 0.4
"""That share of the way at full speed, and the largest share of half the frame's least edge."""

SPEED_SHARE = 0.25
"""Full speed crosses this share of half the frame's largest edge in a second, or is the rated
speed of the cables, whichever is less."""

EXPLICIT_STEP = 2e-3
"""Longest integration step, with which weight and gyroscopic moments are followed [s]."""

EFFORT, OVERLOAD, LOSS = 0.01, 0.1, 10.0
"""What a reward loses: by the mean square of the actions, the share of cables above their largest
tension, and once at the end of an episode that failed."""

DISTANCE_SHARE, ANGLE = 0.25, 0.2
"""Of the reach a distance, and an angle [rad], at which rewards are down to 1 - tanh 1."""

NEAR_SHARE, NEAR_ANGLE = 0.05, math.radians(2.0)
"""Of the reach the distance, and the angle [rad], at which a task is a success."""

MEMBERS_KEPT = 4
"""Times as many drawn robots as a task moves are kept. Whoever compares policies gives them the
same seeds: each robot is then made once, and its rest sought once."""

MOST_STARTS = 100
"""Starts that are drawn for one episode, of which none is held, after which more are of no use."""


@dataclass(frozen=True, kw_only=True)
class TaskOptions:
    """What every task takes.

    Attributes:
        robot: A robot that ships, by name, a robot file, or a `Robot`.
        action: One of `ACTIONS`.
        period: For which an action holds [s].
        randomise: Standard deviations by names of parameters, with `*`, in SI units; what `cdpr
            calibrate` or `cdpr identify` wrote, with its covariance; or a `ParameterCovariance`.
            Each episode draws the robot anew. None: it is as its file says.
        winches: "ideal", or "motor" with the friction of the robot's file.
        turn_deg: By how much starts and goals are turned from home, at most about each axis [deg].
        threads: Threads that move many robots; None: as many as cores.
    """

    robot: Robot | str | Path = "acrobot_small"
    action: str = RATES
    period: float = 0.02
    randomise: ParameterCovariance | Mapping[str, float] | Path | str | None = None
    winches: str = "ideal"
    turn_deg: float = 0.0
    threads: int | None = None


class RobotTask(ABC):
    """Episodes of robots of one structure, a row for each.

    Attributes:
        options: What was asked for.
        robot: The robot in the middle, which is believed.
        count: Number of robots.
        batch: The robots.
        box: Where episodes are drawn.
        reach: Half edge of that box [m].
        scales: Of observations, see `task_kernel.LENGTH`: reach [m], full speed [m/s], full speed
            of turning [rad/s], largest tension [N].
        action_size: Numbers of an action.
        observation_size: Numbers of an observation.
    """

    Options: ClassVar[type[TaskOptions]] = TaskOptions
    steps: ClassVar[int] = 250
    """Steps of an episode."""

    more_actions: ClassVar[int] = 0
    """Numbers of an action behind those that move the robot."""

    def __init__(self, count: int, options: TaskOptions) -> None:
        """Robots at home; `begin` comes next.

        Raises:
            CdprError: An option is not accepted, or the robot cannot do this.
        """
        _check(options)
        self.options, self.count = options, count
        robot = self.robot = as_robot(options.robot, "a learning environment")
        settings = CableRobotSettings(winches=WinchSettings(kind=options.winches))
        by_tensions = options.action == TENSIONS
        step = EXPLICIT_STEP
        if not by_tensions:
            X_home = robot.home.transform()
            step = min(step, automatic_step(robot, X_home, "runge_kutta3", settings))
        self.batch = BatchRobots(
            robot, count, settings=settings, rule=StepRule(max_step=step),
            by_tensions=by_tensions, threads=options.threads,
        )  # fmt: skip
        self._doubt = _doubt(robot, options.randomise)
        self._of_a_robot, self._drawn_members = (settings, by_tensions), dict[int, BatchMember]()
        edges = 0.5 * (np.asarray(robot.frame.upper) - np.asarray(robot.frame.lower))
        self._lower, self._upper = robot.frame.bounds()
        speed = min(robot.winch.rated_cable_speed(), SPEED_SHARE * float(np.max(edges)))
        basis = robot.motion_type().basis(robot.home.transform().rotation().matrix())
        room = np.min(np.abs(basis[3:]).T @ edges, initial=np.inf, where=np.any(basis[3:], axis=0))
        half = min(ROOM_SHARE * float(room), REACH_SHARE * speed * REACH_TIME)
        self.box = HeldBox(robot, settings, half)
        self.reach = self.box.half
        arm = float(np.sqrt(np.mean(np.sum(np.square(robot.cable_set().p_PB), axis=0))))
        turn_speed = min(1.0, speed / arm) if arm > 0.0 else 1.0
        self.scales = np.array([self.reach, speed, turn_speed, robot.tension_limits()[1]])
        self._basis = basis
        self._believed = settings.cables.cable_set(robot).packed()
        m = self.batch.cables
        moving = {RATES: self.batch.commands_per_robot, TENSIONS: m, TWIST: basis.shape[1]}
        self._moving = moving[options.action]
        self.action_size = self._moving + self.more_actions
        self.observation_size = self._observed()
        self._home_row = pose_row(self.box.home)
        self._randoms: list[np.random.Generator | None] = [None] * count
        self._numbers = np.zeros((count, self.observation_size))
        self._tensions = self.batch.tensions
        self.rewards = np.zeros(count)
        self.lost = np.zeros(count, bool)

    # --- What a task is -------------------------------------------------------------------------

    def _observed(self) -> int:
        """Numbers of an observation."""
        return PLATFORM + self.batch.cables + self._aimed()

    @abstractmethod
    def _aimed(self) -> int:
        """Numbers of an observation behind those of the platform."""

    @abstractmethod
    def _begin(self, row: int, random: np.random.Generator) -> RigidTransform:
        """Draws what an episode is about; the pose at which it starts [m]."""

    @abstractmethod
    def _look(self, rows: np.ndarray, moved: bool) -> None:
        """Writes observations behind those of the platform, and what rewards need.

        Args:
            rows: Who is looked at; others may be, too, where that draws no random numbers.
            moved: Whether they moved on; else their episodes begin.
        """

    @abstractmethod
    def _judge(self, actions: Array) -> None:
        """Adds to `rewards`, shape (count,), before costs, and to `lost` who failed."""

    @abstractmethod
    def infos(self) -> dict[str, np.ndarray]:
        """Numbers for people, of each robot, by names; each of shape (count,)."""

    def _act(self, actions: Array) -> None:
        """What actions do beside moving the robots, before they move: nothing."""
        return

    def add_bodies(self, plant: MultibodyPlant) -> list[RigidBody]:
        """Adds what pictures show beside the robot: nothing."""
        return []

    def places(self, row: int) -> list[RigidTransform]:
        """Where these bodies are for a robot, X_W of each [m]."""
        return []

    # --- Episodes -------------------------------------------------------------------------------

    def begin(self, rows: Sequence[int], randoms: Sequence[np.random.Generator]) -> None:
        """Begins new episodes.

        Args:
            rows: Of these robots.
            randoms: Where the random numbers of each come from, till its episode ends.

        Raises:
            CdprError: No start is held.
        """
        for row, random in zip(rows, randoms, strict=True):
            self._randoms[row] = random
            self._restore(row, random)
            for trial in range(MOST_STARTS):
                try:
                    self.batch.reset([row], [self._begin(row, random)])
                    break
                except InfeasibleTensionError as problem:
                    if trial == MOST_STARTS - 1:
                        raise CdprError(
                            f"robot {self.robot.name}: found none of {MOST_STARTS} starts that it "
                            f"holds ({problem}); accepted: parameters that are better known"
                        ) from problem
        self._observe(np.asarray(rows, dtype=int), moved=False)

    def _restore(self, row: int, random: np.random.Generator) -> None:
        """Gives a robot the parameters of a new episode."""
        if self._doubt is not None:
            self.batch.exchange(row, self._drawn_member(self._doubt, int(random.integers(2**62))))

    def _drawn_member(self, doubt: ParameterCovariance, seed: int) -> BatchMember:
        """The robot of a seed."""
        kept = self._drawn_members
        if seed not in kept:
            if len(kept) >= MEMBERS_KEPT * self.count:
                del kept[next(iter(kept))]  # the oldest one
            robot = drawn_robots(self.robot, 1, doubt, seed)[0]
            kept[seed] = BatchMember.of(robot, *self._of_a_robot)
        return kept[seed]

    def step(self, actions: Any, over: np.ndarray | None = None) -> None:
        """Moves all robots on by a period; then `observations`, `rewards` and `lost` are new.

        Args:
            actions: Shape (count, action_size), cut at -1 and 1.
            over: Whose episodes are over, shape (count,): they draw no random numbers, and mean
                nothing till they begin anew. None: nobody's.

        Raises:
            CdprError: They are of another shape, or not finite.
        """
        given = np.asarray(actions, float)
        if given.shape != (self.count, self.action_size) or not np.isfinite(given).all():
            raise CdprError(
                f"actions: found shape {given.shape}, {int(np.sum(~np.isfinite(given)))} numbers "
                f"not finite; accepted: ({self.count}, {self.action_size}), finite"
            )
        cut = np.clip(given, -1.0, 1.0)
        self._act(cut)
        self.batch.step(self._commands(cut), self.options.period)
        self._observe(np.arange(self.count) if over is None else np.flatnonzero(~over), moved=True)
        self.rewards = np.zeros(self.count)
        places = self.batch.poses[:, 4:]
        outside = np.any((places < self._lower) | (places > self._upper), axis=1)
        self.lost = self.batch.failed | outside
        self._judge(cut)
        take_costs(cut, self._tensions, float(self.scales[3]), EFFORT, OVERLOAD, self.rewards)
        self.rewards[self.lost] -= LOSS

    def _commands(self, actions: Array) -> Array:
        """What the batch is commanded, shape (count, k)."""
        own, speed = np.ascontiguousarray(actions[:, : self._moving]), float(self.scales[1])
        if self.options.action == RATES:
            return speed * own
        if self.options.action == TENSIONS:
            low, high = self.robot.tension_limits()
            return low + 0.5 * (own + 1.0) * (high - low)
        twists = np.zeros((self.count, 6))
        for k in range(self._moving):  # column by column, so that no sum depends on the count
            twists = twists + own[:, k : k + 1] * self._basis[:, k]
        twists[:, :3] *= self.scales[2]
        twists[:, 3:] *= speed
        rates = np.empty((self.count, self.batch.cables))
        write_rates(self.batch.poses, twists, self._believed, rates)
        return self._of_winches(rates)

    def _of_winches(self, rates: Array) -> Array:
        """Of cables on one winch the rate of the first."""
        groups = self.robot.winch_groups()
        first = [groups.of_cable.index(k) for k in range(self.batch.commands_per_robot)]
        return rates[:, first]

    def _observe(self, rows: np.ndarray, *, moved: bool) -> None:
        tensions = self.batch.tensions
        self._tensions = np.where(np.isfinite(tensions), tensions, 0.0)  # of who failed
        self._look_at_platforms()
        self._look(rows, moved)

    def _look_at_platforms(self) -> None:
        """Writes what robots know of themselves."""
        write_platform(
            self.batch.poses, self.batch.twists, self._tensions, self._home_row, self.scales,
            self._numbers,
        )  # fmt: skip

    def observations(self) -> np.ndarray:
        """What is observed now, shape (count, observation_size), 32 bits [-]."""
        return np.clip(self._numbers, -MOST, MOST).astype(np.float32)

    def _random(self, row: int) -> np.random.Generator:
        """Where the random numbers of a robot's episode come from."""
        random = self._randoms[row]
        assert random is not None  # its episode has begun
        return random

    def _own(self) -> Array:
        """Where a task writes its observations: the rows behind those of the platform."""
        return self._numbers[:, PLATFORM + self.batch.cables :]

    def _drawn_pose(self, random: np.random.Generator, share: float = 1.0) -> RigidTransform:
        """A pose of the box, or of a share of it [m]."""
        point = np.array(random.uniform(-share, share, self.box.directions.shape[1]), float)
        most = math.radians(self.options.turn_deg)
        turn = np.array(random.uniform(-most, most, self.box.turns.shape[1]), float)
        return self.box.at(point, turn if most > 0.0 else None)


def _doubt(
    robot: Robot, given: ParameterCovariance | Mapping[str, float] | Path | str | None
) -> ParameterCovariance | None:
    """The covariance that episodes draw from.

    Raises:
        CdprError: It names no parameter of the robot, or there is none.
    """
    if given is None or isinstance(given, ParameterCovariance):
        return given
    if isinstance(given, str | Path):
        return ParameterCovariance.of(given)
    deviations: dict[str, float] = {}
    known = parameter_names(robot)
    for pattern, deviation in given.items():
        names = [name for name in known if fnmatchcase(name, pattern)]
        if not names:
            raise CdprError(
                f"randomise: found {pattern!r}; accepted: names of parameters of {robot.name}, "
                f"with *, as {', '.join(known[:2])}, {known[-2]}"
            )
        if not (np.isfinite(deviation) and deviation >= 0.0):
            raise CdprError(f"randomise: {pattern}: found {deviation!r}; accepted: 0 or more")
        deviations |= dict.fromkeys(names, float(deviation))
    return ParameterCovariance.independent(deviations)


def _check(options: TaskOptions) -> None:
    if options.action not in ACTIONS:
        raise CdprError(
            f"action: found {options.action!r}; {accepted_names(options.action, ACTIONS)}"
        )
    if options.winches == "motor" and options.action == TENSIONS:
        raise CdprError("winches: found motor for the action tensions; accepted: ideal")
    if options.winches not in ("ideal", "motor"):
        raise CdprError(f"winches: found {options.winches!r}; accepted: ideal, motor")
    if not (np.isfinite(options.period) and 0.0 < options.period <= 1.0):
        raise CdprError(f"period: found {options.period!r}; accepted: above 0, at most 1 [s]")
    if not (0.0 <= options.turn_deg <= 90.0):
        raise CdprError(f"turn_deg: found {options.turn_deg!r}; accepted: 0 to 90 [deg]")
