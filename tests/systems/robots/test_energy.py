"""Energy is kept where nothing takes it, else it is what winches put in."""

import numpy as np
import pytest

from cdpr_drake.cables.catenary_kernel import free_part, stored_energy
from cdpr_drake.cables.elastic_law import elastic_energy
from cdpr_drake.cables.hanging_kernel import solve_catenary
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.cable_robot import CableRobot
from tests.models.robots import robot_of
from tests.models.test_platform_pulleys import robot_content
from tests.systems.robots.engines import (
    POSE,
    integrate,
    moved,
    pose,
    put,
    read,
    settings_of,
    started,
)

ENERGY_DRIFT = 1e-6
"""Change of the total energy without damping, relative to the energy of the motion: what the motion
has above the equilibrium that it swings about. Steps are 1/200 of the fastest period."""

SWING = np.array([0.02, -0.015, 0.03, 0.002, 0.003, -0.003])
"""Cables a thousand times softer stay taut; tensions swing by nearly what they are at rest."""


def undamped(softer=1.0, heavier=1.0, robot=None):
    """ACROBOT with the small platform, without damping, on softer cables, or heavier ones."""
    robot = robot or load_robot("acrobot_small")
    robot.cable.retardation_time = 0.0
    robot.cable.youngs_modulus /= softer
    robot.cable.linear_density *= heavier
    return robot


def energy(block, context):
    """Kinetic, potential, and that of the cables: elastic, and their own weight where they sag."""
    plant_context = block.plant.GetMyContextFromRoot(context)
    total = block.plant.CalcKineticEnergy(plant_context)
    total += block.plant.CalcPotentialEnergy(plant_context)
    l0 = read(block, context, "unstrained_lengths")
    cables = block.forces.cable_set()
    if block.forces.model() != "catenary":
        return total + elastic_energy(read(block, context, "lengths"), l0, cables.stiffness)
    along = pose(block, context).multiply(cables.p_PB) - cables.p_WA
    for i in range(8):
        x, z = np.hypot(along[0, i], along[1, i]), along[2, i]
        ES, w = cables.stiffness[i], cables.linear_weight[i]
        H, V_A, good = solve_catenary(x, z, 0.0, 1.0, l0[i], ES, w, 0.0, 0.0)
        assert good
        *_, V, S, phi = free_part(H, V_A, l0[i], ES, w)
        total += stored_energy(x, z, l0[i], ES, w, H, V, S, phi)
    return total


SOFT, HEAVY = undamped(1e3), undamped(1e3, heavier=20.0)
SWINGS = {
    "straight": (SOFT, "elastic", False, 5e-4, 0.5),
    "pulleys": (SOFT, "elastic", True, 5e-4, 0.5),
    "pulleys at the platform": (
        undamped(200.0, robot=robot_of(robot_content())), "elastic", True, 2.5e-4, 0.25
    ),
    "catenary": (SOFT, "catenary", False, 5e-4, 0.5),
    "heavy catenary": (HEAVY, "catenary", False, 5e-4, 0.5),
}  # fmt: skip


@pytest.mark.parametrize("swing", SWINGS)
def test_undamped_cables_keep_the_energy(swing):
    robot, model, pulleys, step, duration = SWINGS[swing]
    how = settings_of(model=model, pulleys=pulleys)
    block, simulator, context = started(CableRobot, robot, how, X_WP=POSE)
    integrate(block, simulator, step, "runge_kutta5")
    rest = energy(block, context)
    put(block, context, moved(POSE, SWING))
    start = energy(block, context)
    for time in np.linspace(0.0, duration, 21)[1:]:
        simulator.AdvanceTo(time)
        assert abs(energy(block, context) - start) < ENERGY_DRIFT * (start - rest)
        assert model == "catenary" or not np.any(read(block, context, "slack"))


MOTOR_ENERGY = 1e-5
"""Change of the energy with motors, relative to what the motors put in."""


def test_platform_cables_and_motors_hold_what_the_torques_put_in():
    """Stretched cable takes power t e / 2 per length onto the drum with it: dV/dl0 of an elastic
    cable is -t (1 + e / 2), and the drum feels t."""
    robot = undamped(softer=100.0)
    robot.winch.friction = None
    block, simulator, context = started(CableRobot, robot, settings_of("torque"), 2e-4)
    rho = robot.winch_law().drum.length_per_angle(np.zeros(8))
    torques = -rho * read(block, context, "drum_tensions")
    torques *= np.array([1.3, 1.0, 0.9, 1.2, 1.0, 1.1, 0.8, 1.2])
    block.GetInputPort("motor_torques").FixValue(context, torques)

    def whole():
        speeds = read(block, context, "motor_speeds")
        total = energy(block, context) + 0.5 * robot.winch.inertia * np.sum(speeds**2)
        return total - torques @ read(block, context, "motor_angles")

    def wound_power():
        strain = read(block, context, "lengths") / read(block, context, "unstrained_lengths") - 1.0
        rates = read(block, context, "unstrained_length_rates")
        return np.sum(0.5 * robot.stiffness() * np.maximum(strain, 0.0) ** 2 * rates)

    start, angles, powers = whole(), read(block, context, "motor_angles"), [0.0]
    for time in np.arange(1, 201) * 1e-3:
        simulator.AdvanceTo(time)
        powers.append(wound_power())
    put_in = np.abs(torques) @ np.abs(read(block, context, "motor_angles") - angles)
    assert put_in > 0.03
    wound = np.trapezoid(powers, dx=1e-3)
    assert abs(whole() + wound - start) < MOTOR_ENERGY * put_in
