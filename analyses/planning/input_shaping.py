"""Rest to rest without swing, by input shaping: for elastic robots and those on few cables.

The winches wind unstrained lengths l0(s), with s(t) a quintic law of time that is convolved with
impulses, see `planning.make_shaper`, for the platform's slowest vibrations at rest: those of the
cables' true stiffness, and the swinging of a platform on fewer cables than degrees of freedom.
What is left is measured on the simulated robot. The robots know nothing of the platform's motion:
nothing is fed back.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import TrajectorySource, ZeroOrderHold
from pydrake.trajectories import PiecewisePolynomial
from scipy.interpolate import BSpline, CubicSpline

from cdpr_drake.arrays import Array
from cdpr_drake.errors import InfeasibleTensionError, PlanningError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_in_plant import pose_on_joint
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.planning.input_shaping import NO_SHAPER, Shaper, make_shaper, shaped_share
from cdpr_drake.statics.equilibrium import Equilibrium, equilibrium_near
from cdpr_drake.statics.static_tensions import find_static_tensions
from cdpr_drake.statics.stiffness import natural_modes, platform_stiffness
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_motion import HELD
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings, DampingSettings
from cdpr_drake.trajectories.pose_path import straight_path

PERIOD = 1e-3  # of the commands [s]
STEP = 1e-4  # of the integration [s]
LOOK = 2e-3  # between looks at the platform [s]
KNOTS = 21  # poses along the way at which the lengths are found
SPEED_LOOKS = 400  # instants at which the speeds of a command are looked at

SLOW = 8.0
"""Vibrations that are faster than so many a motion are left alone: a smooth law of time does not
wake them."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ShapedRest:
    """A motion from rest to rest by commanded lengths.

    Attributes:
        robot: The robot.
        cables: How its cables behave.
        lengths: l0 by s from 0 to 1, gives shape (m,) [m].
        duration: Of the law of time before it is shaped [s].
        shaper: What shapes it.
        frequencies: Of all vibrations at the start, halfway and at the goal, shape (3, n) [Hz].
        start: The platform at rest at the start.
        goal: The platform at rest at the goal.
        correction: What is added to the lengths over time, zero in value and velocity at both ends
            of the duration, gives shape (m,) [m]; None: nothing. Not together with a shaper.
    """

    robot: Robot
    cables: CableSettings
    lengths: CubicSpline
    duration: float
    shaper: Shaper
    frequencies: Array
    start: Equilibrium
    goal: Equilibrium
    correction: BSpline | None = None

    @property
    def end_time(self) -> float:
        """When the command ends [s]."""
        return self.duration + self.shaper.duration

    def lengths_at(self, times: Array) -> Array:
        """Unstrained lengths that are commanded at times [s], shape (n, m) [m]."""
        s, _, _ = shaped_share(self.shaper, self.duration, times)
        l0 = np.asarray(self.lengths(s), float)
        if self.correction is not None:
            l0 += self.correction(np.clip(times, 0.0, self.duration))
        return l0


@dataclass(frozen=True, eq=False)
class Swing:
    """What the platform does after a command has ended.

    Attributes:
        times: Since the start, shape (n,) [s].
        distances: Of Po from where it shall rest, shape (n,) [m].
        end_time: When the command ends [s].
    """

    times: Array
    distances: Array
    end_time: float

    def left(self) -> float:
        """Largest distance after the end [m]."""
        return float(np.max(self.distances[self.times >= self.end_time]))


def plan_shaped_rest(
    robot: Robot, start: RigidTransform, goal: RigidTransform, duration: float,
    kind: str | None = "ZVD", *, cables: CableSettings | None = None,
    bounds: tuple[float, float] | None = None,
) -> ShapedRest:  # fmt: skip
    """Plans a motion that leaves little swing.

    Args:
        robot: The robot. On fewer cables than degrees of freedom it hangs where these lengths let
            it: the poses are where it is looked for.
        start: Pose at the start [m].
        goal: Pose at the end [m].
        duration: Of the law of time before it is shaped, above 0 [s].
        kind: A shaper; None: the motion as it is, to compare with.
        cables: How the cables behave; Kelvin-Voigt, without pulleys, if None.
        bounds: Smallest and largest tension along the way; the robot's if None [N].

    Raises:
        PlanningError: The duration or the kind is not accepted, a winch would have to be faster
            than it can, or the platform is not stable.
        InfeasibleTensionError: No tensions within the bounds hold a pose on the way.
        EquilibriumError: No pose of rest is found near a pose.
    """
    if not (np.isfinite(duration) and duration > 0.0):
        raise PlanningError(f"duration: found {duration:g} s; accepted: above 0")
    if robot.winch_groups().are_shared():
        raise PlanningError(
            f"robot {robot.name}: found several cables on one winch; accepted: one each"
        )
    settings = cables or CableSettings()
    l0 = _lengths(robot, settings, (start, goal), robot.tension_limits(bounds))
    real, platform = settings.cable_set(robot), rigid_platform(robot)
    model, (push, turn) = settings.model_of(robot), DampingSettings().of(robot)
    D = np.diag([turn] * 3 + [push] * 3)
    poses = straight_path([start, goal], 1.0)
    rests, frequencies, dampings, shaper = [], [], [], NO_SHAPER
    for s in (0.0, 0.5, 1.0):
        rest = equilibrium_near(
            real, model, platform, l0(s), poses.pose(s * poses.length), soften=s == 0.0
        )
        K = platform_stiffness(real, model, platform, rest.X_WP, l0(s))
        modes = natural_modes(K.total, platform, rest.X_WP)
        if not np.all(modes.frequencies > 0.0):
            raise PlanningError(
                f"{robot.name} at {s:.0%} of the way: found a platform that is not stable; "
                "accepted: poses of rest with restoring forces in all directions"
            )
        rests.append(rest)
        frequencies.append(modes.frequencies)
        w = 2.0 * np.pi * modes.frequencies
        elastic = np.zeros((6, 6)) if K.elastic is None else K.elastic
        stretch = np.einsum("in,ij,jn->n", modes.shapes, elastic, modes.shapes)
        # Kelvin and Voigt damp what stretches, D damps the platform:
        # 2 zeta w = T s' K_elastic s + s' D s, with s' M s = 1.
        braked = np.einsum("in,ij,jn->n", modes.shapes, D, modes.shapes)
        dampings.append((float(np.mean(real.retardation)) * stretch + braked) / (2.0 * w))
    if kind is not None:
        shaper = _shaper(kind, np.mean(frequencies, axis=0), np.mean(dampings, axis=0), duration)
    motion = ShapedRest(
        robot=robot, cables=settings, lengths=l0, duration=duration, shaper=shaper,
        frequencies=np.array(frequencies), start=rests[0], goal=rests[2],
    )  # fmt: skip
    check_speeds(motion)
    return motion


def check_speeds(motion: ShapedRest) -> None:
    """Raises a PlanningError where a winch would have to turn faster than it can."""
    times = np.linspace(0.0, motion.end_time, SPEED_LOOKS)
    s, rate, _ = shaped_share(motion.shaper, motion.duration, times)
    moved = motion.lengths(s, 1) * rate[:, np.newaxis]
    if motion.correction is not None:
        moved = moved + motion.correction.derivative()(times)
    speeds = np.max(np.abs(moved), axis=0)
    worst, most = int(np.argmax(speeds)), motion.robot.winch.rated_cable_speed()
    if speeds[worst] > most:
        raise PlanningError(
            f"duration: found {motion.duration:g} s, in which {motion.robot.cables[worst].name} "
            f"would be wound at {speeds[worst]:.4g} m/s; accepted: cable speeds to {most:.4g} m/s"
        )


def simulate_swing(
    motion: ShapedRest, watch: float = 2.0, cables: CableSettings | None = None
) -> Swing:
    """Simulates the command, and the platform for a while after it.

    Args:
        motion: The motion.
        watch: How long the platform is looked at after the command [s].
        cables: How the simulated cables behave; None: as they were planned with. The platform
            begins at rest on these, and is looked at from where it rests on them in the end.
    """
    robot = motion.robot
    end, settings = motion.end_time + watch, cables or motion.cables
    rest, goal = (motion.start, motion.goal) if cables is None else rests_on(motion, cables)
    block = CompiledCableRobot(
        robot, CableRobotSettings(cables=settings), command_period=HELD,
        rule=StepRule(method="runge_kutta3", max_step=STEP),
    )  # fmt: skip
    builder = DiagramBuilder()
    builder.AddNamedSystem("robot", block)
    source = builder.AddNamedSystem("velocities", TrajectorySource(_velocities(motion, end)))
    hold = builder.AddNamedSystem("hold", ZeroOrderHold(PERIOD, block.motion.cable_set().count))
    builder.Connect(source.get_output_port(), hold.get_input_port())
    builder.Connect(hold.get_output_port(), block.GetInputPort("cable_velocities"))
    simulator = Simulator(builder.Build())
    context = block.motion.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    block.motion.hold(context, rest.X_WP, motion.lengths(0.0), rest.tensions)
    times = np.asarray(np.arange(int(np.ceil(end / LOOK)) + 1) * LOOK, dtype=np.float64)
    place = goal.X_WP.translation()
    distances = np.empty(len(times))
    joint = robot.joint()
    for k, t in enumerate(times):
        simulator.AdvanceTo(t)
        X_WP = pose_on_joint(joint, block.motion.state(context)[: joint.num_states])
        distances[k] = np.linalg.norm(X_WP.translation() - place)
    return Swing(times, distances, motion.end_time)


def rests_on(motion: ShapedRest, cables: CableSettings) -> tuple[Equilibrium, Equilibrium]:
    """Where the platform rests at the start and in the end on other cables than was planned with.

    Raises:
        EquilibriumError: There is no pose of rest nearby.
    """
    real, platform = cables.cable_set(motion.robot), rigid_platform(motion.robot)
    model = cables.model_of(motion.robot)
    start, goal = (
        equilibrium_near(real, model, platform, motion.lengths(s), rest.X_WP)
        for s, rest in ((0.0, motion.start), (1.0, motion.goal))
    )
    return start, goal


def _velocities(motion: ShapedRest, end: float) -> PiecewisePolynomial:
    """Cable velocities, constant for a period, that wind exactly the lengths of the plan."""
    times = np.asarray(np.arange(int(np.ceil(end / PERIOD)) + 2) * PERIOD, dtype=np.float64)
    steps = np.diff(motion.lengths_at(times), axis=0).T / PERIOD
    # Held from the beginning of each period: half a period early, the velocity is that of the
    # period, whichever way times are rounded.
    velocities = np.column_stack([steps, np.zeros(len(steps))])
    held: PiecewisePolynomial = PiecewisePolynomial.ZeroOrderHold(times - 0.5 * PERIOD, velocities)
    return held


def _lengths(
    robot: Robot, settings: CableSettings, ends: tuple[RigidTransform, RigidTransform],
    bounds: tuple[float, float],
) -> CubicSpline:  # fmt: skip
    """Unstrained lengths by s from 0 to 1."""
    cables, platform = settings.cable_set(robot), rigid_platform(robot)
    model = settings.model_of(robot)
    path = straight_path(ends, 1.0)
    if cables.count < platform.motion.freedom:  # nothing to choose: they hang as long as they are
        l0 = np.array([cable_paths(X, cables).lengths for X in ends])
        return CubicSpline([0.0, 0.5, 1.0], np.array([l0[0], 0.5 * (l0[0] + l0[1]), l0[1]]))
    knots, lengths = np.linspace(0.0, 1.0, KNOTS), []
    for s in knots:
        X_WP = path.pose(s * path.length)
        wrench = platform.weight_wrench(X_WP)
        held = find_static_tensions(cables, model, X_WP, wrench, bounds, platform.motion)
        if held is None:
            raise InfeasibleTensionError(
                f"{robot.name} cannot hold the platform at {X_WP.translation().round(4)} m: no "
                f"tensions within {bounds[0]:g} to {bounds[1]:g} N do"
            )
        lengths.append(held.unstrained_lengths)
    return CubicSpline(knots, np.array(lengths))


def _shaper(kind: str, frequencies: Array, dampings: Array, duration: float) -> Shaper:
    """One shaper for all vibrations that a motion may wake, the slowest first."""
    shaper = NO_SHAPER
    for f, damping in zip(frequencies, dampings, strict=True):
        if f * duration <= SLOW and damping < 0.5:
            shaper = shaper.then(make_shaper(kind, 2.0 * np.pi * f, damping))
    return shaper
