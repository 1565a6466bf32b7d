"""A rest-to-rest motion of a planar robot with elastic cables, by direct collocation.

Elastic cables let the platform swing. The optimizer knows them: it differentiates the Diagram of
plant, cables and winches, and finds cable velocities that end without a swing. It is also an
example of what a differentiable plant is for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.planning import DirectCollocation
from pydrake.solvers import Solve
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import TrajectorySource
from pydrake.trajectories import PiecewisePolynomial, Trajectory
from scipy.integrate import trapezoid

from cdpr_drake.arrays import Array
from cdpr_drake.errors import InfeasibleTensionError
from cdpr_drake.geometry.motion_type import LEVEL
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.statics.static_tensions import find_static_tensions
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings

RUBBER = 1e8
"""Young's modulus [Pa] of the example's cables: soft, so that there is something to swing on."""

STEP = 2e-4  # integration step of simulations of a plan [s]


@dataclass(frozen=True, kw_only=True)
class RestToRest:
    """A motion from rest to rest.

    The state is (x, y, theta), their rates and the unstrained lengths.

    Attributes:
        robot: The robot.
        cables: Its simulated cables.
        duration: Time that the motion takes [s].
        start: State at rest, shape (6 + m,).
        goal: State at rest where it ends, shape (6 + m,).
        straight: Cable velocities that wind from start to goal without minding the swing [m/s].
        planned: Cable velocities of the plan [m/s]; the straight ones where it failed.
        success: Whether the optimizer found a plan.
        cost: Integral of the squared cable velocities of the plan [m^2/s].
    """

    robot: Robot
    cables: CableSettings
    duration: float
    start: Array
    goal: Array
    straight: Trajectory
    planned: Trajectory
    success: bool
    cost: float

    def simulated_end(self, velocities: Trajectory) -> Array:
        """State at the end of a simulation with these cable velocities, shape (6 + m,)."""
        builder = DiagramBuilder()
        robot = CableRobot(self.robot, CableRobotSettings(cables=self.cables))
        block = builder.AddNamedSystem("robot", robot)
        source = builder.AddNamedSystem("velocities", TrajectorySource(velocities))
        builder.Connect(source.get_output_port(), block.GetInputPort("cable_velocities"))
        simulator = Simulator(builder.Build())
        simulator.get_mutable_context().SetContinuousState(self.start)
        ResetIntegratorFromFlags(simulator, "runge_kutta3", STEP).set_fixed_step_mode(True)
        simulator.AdvanceTo(self.duration)
        state: Array = simulator.get_context().get_continuous_state_vector().CopyToVector()
        return state

    def swing(self, velocities: Trajectory) -> float:
        """Speed of the platform at the end of a simulation, where it should rest [m/s]."""
        return float(np.linalg.norm(self.simulated_end(velocities)[3:5]))


def example_robot() -> Robot:
    """The planar robot on cables of rubber."""
    robot = load_robot("planar")
    robot.cable.youngs_modulus, robot.cable.retardation_time = RUBBER, 2e-3
    return robot


def plan_rest_to_rest(
    robot: Robot, start: tuple[float, float, float], goal: tuple[float, float, float],
    duration: float, samples: int = 25, *, cables: CableSettings | None = None,
    bounds: tuple[float, float] = (10.0, 60.0),
) -> RestToRest:  # fmt: skip
    """Plans a motion of least squared cable velocities from rest to rest.

    Args:
        robot: A planar robot.
        start: Where it begins: x, y [m] and theta [rad].
        goal: Where it ends.
        duration: Time that the motion takes [s].
        samples: Points of the plan in time, at least 2; fewer are faster and less exact.
        cables: How the cables behave; Kelvin-Voigt over pulleys if None.
        bounds: Smallest and largest tension at rest at both ends [N].

    Raises:
        InfeasibleTensionError: No tensions within the bounds hold a pose on the way.
    """
    settings = cables or CableSettings(pulleys=True)
    begin, way = np.asarray(start, float), np.subtract(goal, start)
    times = np.linspace(0.0, duration, samples)
    share = times / duration
    places = begin + np.outer(share**3 * (10.0 - 15.0 * share + 6.0 * share**2), way)
    rates = np.outer(30.0 * share**2 * (1.0 - share) ** 2 / duration, way)
    lengths = [_lengths(robot, settings, place, bounds) for place in places]
    states = np.hstack([places, rates, lengths]).T
    winding = np.gradient(states[6:], times, axis=1)
    # Of the straight motion, the integral has to be what the lengths change by.
    winding += ((states[6:, -1] - states[6:, 0]) - trapezoid(winding, times))[:, None] / duration
    straight = PiecewisePolynomial.FirstOrderHold(times, winding)

    block = CableRobot(robot, CableRobotSettings(cables=settings))
    context = block.CreateDefaultContext()
    port = block.GetInputPort("cable_velocities")
    port.FixValue(context, np.zeros(len(robot.cables)))
    step = duration / (samples - 1)
    program = DirectCollocation(
        block, context, samples, step, step, input_port_index=port.get_index()
    )
    prog, speed = program.prog(), np.full(len(robot.cables), robot.winch.rated_cable_speed())
    prog.AddBoundingBoxConstraint(states[:, 0], states[:, 0], program.initial_state())
    prog.AddBoundingBoxConstraint(states[:, -1], states[:, -1], program.final_state())
    for k in range(samples):
        prog.AddBoundingBoxConstraint(-speed, speed, program.input(k))
    program.AddRunningCost(sum(u * u for u in program.input()))
    program.SetInitialTrajectory(straight, PiecewisePolynomial.FirstOrderHold(times, states))
    result = Solve(prog)
    success = bool(result.is_success())
    planned = program.ReconstructInputTrajectory(result) if success else straight
    return RestToRest(
        robot=robot, cables=settings, duration=duration, start=states[:, 0], goal=states[:, -1],
        straight=straight, planned=planned, success=success, cost=float(result.get_optimal_cost()),
    )  # fmt: skip


def _lengths(
    robot: Robot, settings: CableSettings, place: Array, bounds: tuple[float, float]
) -> Array:
    """Unstrained lengths that hold a planar platform at (x, y, theta), shape (m,) [m]."""
    assert robot.plane_height is not None
    R = RotationMatrix.MakeZRotation(place[2])
    X_WP = RigidTransform(R, [place[0], place[1], robot.plane_height])
    rest = find_static_tensions(
        settings.cable_set(robot), settings.model_of(robot), X_WP, np.zeros(6), bounds, LEVEL
    )
    if rest is None:
        raise InfeasibleTensionError(
            f"{robot.name} cannot hold the platform at ({place[0]:g}, {place[1]:g}) m: no tensions "
            f"within {bounds[0]:g}..{bounds[1]:g} N balance each other"
        )
    return rest.unstrained_lengths
