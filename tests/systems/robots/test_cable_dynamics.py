"""Motion on cables of all models: energy is kept where nothing takes it, integrators agree."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

from cdpr_drake.cables.catenary_kernel import free_part, stored_energy
from cdpr_drake.cables.elastic_law import elastic_energy
from cdpr_drake.cables.hanging_kernel import solve_catenary
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings

ENERGY_DRIFT = 1e-6
"""Change of the energy in 2 s, relative to that of the motion; steps are 1/200 of the fastest
period, and the third power of it counts."""

INTEGRATOR_SHARE = 2e-3
"""Difference of two integrators' positions, relative to the amplitude."""

DURATION = 2.0
POSE = RigidTransform([0.05, -0.08, 0.3])
DISPLACEMENT = np.array([0.02, -0.015, 0.03, 0.002, 0.003, -0.003])


def soft_robot(heavier=1.0):
    """ACROBOT, undamped, on cables a thousand times softer, and heavier if asked."""
    robot = load_robot("acrobot_small")
    robot.cable.retardation_time = 0.0
    robot.cable.youngs_modulus /= 1e3
    robot.cable.linear_density *= heavier
    return robot


def released(robot, settings, displacement):
    block = CableRobot(robot, CableRobotSettings(cables=settings))
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.set_at_equilibrium(context, POSE)
    block.GetInputPort("cable_velocities").FixValue(context, np.zeros(8))
    rest = energy(block, context)
    turned = RigidTransform(
        rotation_from_angles(displacement[:3]) @ POSE.rotation(),
        POSE.translation() + displacement[3:],
    )
    block.in_plant.set_pose(block.plant.GetMyMutableContextFromRoot(context), turned)
    return block, simulator, rest


def energy(block, context):
    """Kinetic, potential, and that of the cables: elastic, and their own weight where they sag."""
    plant_context = block.plant.GetMyContextFromRoot(context)
    total = block.plant.CalcKineticEnergy(plant_context)
    total += block.plant.CalcPotentialEnergy(plant_context)
    l0 = block.GetOutputPort("unstrained_lengths").Eval(context)
    cables = block.forces.cable_set()
    if block.forces.model() != "catenary":
        lengths = block.GetOutputPort("lengths").Eval(context)
        return total + elastic_energy(lengths, l0, cables.stiffness)
    X_WP = block.GetOutputPort("X_WP").Eval(context)
    along = X_WP.multiply(cables.p_PB) - cables.p_WA
    for i in range(8):
        x, z = np.hypot(along[0, i], along[1, i]), along[2, i]
        ES, w = cables.stiffness[i], cables.linear_weight[i]
        H, V_A, good = solve_catenary(x, z, 0.0, 1.0, l0[i], ES, w, 0.0, 0.0)
        assert good
        *_, V, S, phi = free_part(H, V_A, l0[i], ES, w)
        total += stored_energy(x, z, l0[i], ES, w, H, V, S, phi)
    return total


@pytest.mark.parametrize(
    ("settings", "heavier"),
    [
        (CableSettings(model="elastic", pulleys=True), 1.0),
        (CableSettings(model="catenary", pulleys=False), 1.0),
        (CableSettings(model="catenary", pulleys=False), 20.0),
    ],
)
def test_undamped_cables_keep_the_energy(settings, heavier):
    block, simulator, rest = released(soft_robot(heavier), settings, DISPLACEMENT)
    context = simulator.get_context()
    start = energy(block, context)
    ResetIntegratorFromFlags(simulator, "runge_kutta5", 5e-4).set_fixed_step_mode(True)
    for time in np.linspace(0.0, DURATION, 41)[1:]:
        simulator.AdvanceTo(time)
        assert abs(energy(block, context) - start) < ENERGY_DRIFT * (start - rest)


def test_an_explicit_and_an_implicit_integrator_agree():
    settings = CableSettings(model="catenary", pulleys=True)
    ends, amplitude = [], 3e-6
    for integrator in ("runge_kutta3", "radau3"):
        robot = load_robot("acrobot_small")
        displacement = np.array([0.0, 0.0, 0.0, amplitude, 0.0, amplitude])
        block, simulator, _ = released(robot, settings, displacement)
        ResetIntegratorFromFlags(simulator, integrator, 1e-4).set_fixed_step_mode(True)
        path = []
        for time in np.linspace(0.0, 0.1, 11)[1:]:
            simulator.AdvanceTo(time)
            path.append(block.GetOutputPort("X_WP").Eval(simulator.get_context()).translation())
        ends.append(np.array(path))
    assert np.max(np.abs(ends[0] - POSE.translation())) > 0.1 * amplitude
    assert np.max(np.abs(ends[0] - ends[1])) < INTEGRATOR_SHARE * amplitude


def test_without_gravity_and_taut_cables_momentum_stays():
    robot = soft_robot()
    robot.gravity = 0.0
    block = CableRobot(
        robot, CableRobotSettings(cables=CableSettings(model="elastic", pulleys=True))
    )
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.GetInputPort("cable_velocities").FixValue(context, np.full(8, 0.5))  # paid out
    plant_context = block.plant.GetMyMutableContextFromRoot(context)
    velocity = np.array([0.5, -0.3, 0.2, 0.05, 0.1, 0.15])
    block.plant.SetVelocities(plant_context, velocity)
    about = np.zeros(3)
    start = block.plant.CalcSpatialMomentumInWorldAboutPoint(plant_context, about)
    ResetIntegratorFromFlags(simulator, "runge_kutta3", 1e-3).set_fixed_step_mode(True)
    simulator.AdvanceTo(0.5)
    assert np.all(block.GetOutputPort("slack").Eval(context) == 1.0)
    end = block.plant.CalcSpatialMomentumInWorldAboutPoint(plant_context, about)
    np.testing.assert_allclose(end.translational(), start.translational(), atol=1e-12)
    np.testing.assert_allclose(end.rotational(), start.rotational(), atol=1e-9)
