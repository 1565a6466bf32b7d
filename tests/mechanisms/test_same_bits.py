"""Robots with one platform: as cables between bodies they move as they always did, to the bit."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_routes import CableRoutes
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import PlatformDamping
from cdpr_drake.systems.robots.assembly import add_cable_robot
from cdpr_drake.systems.robots.route_assembly import add_cables
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings

ROBOTS = (
    "acrobot_large", "caroca", "cogiro", "fast", "grab_three", "ipanema_1", "kntu_planar", "planar",
    "planar_point", "spider_camera",
)  # fmt: skip
"""In space and in planes, of bodies and points, with three to eight cables."""

DURATION, STEP, LOOKS = 0.3, 1e-3, 6

STIFFNESS = 1e4
"""E S of cables [N]: at this step the integrator does not hold those of the robots' files."""

MODELS = {
    "points": CableSettings(model="kelvin_voigt", pulleys=False),
    "pulleys": CableSettings(model="kelvin_voigt", pulleys=True),
    "sagging": CableSettings(model="catenary", pulleys=True),
}


def states_of(name, settings, as_routes):
    """States of plant and winches, and tensions, from a moving start, by either kind of block."""
    robot, builder = load_robot(name), DiagramBuilder()
    robot.damping = PlatformDamping()  # cables between bodies have no robot's file
    settings = replace(settings, stiffness_ratio=STIFFNESS / np.max(robot.stiffness()))
    plant = builder.AddNamedSystem("plant", MultibodyPlant(0.0))
    in_plant = add_robot(plant, robot)
    plant.Finalize()
    if as_routes:
        routes = CableRoutes.of_cable_set(robot.cable_set(), int(in_plant.body_index))
        block = add_cables(builder, plant, routes, settings)
        assert block.method == "joints"
    else:
        block = add_cable_robot(builder, in_plant, CableRobotSettings(cables=settings))
    builder.ExportInput(block.GetInputPort("cable_velocities"), "cable_velocities")
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    m, nv = len(robot.cables), plant.num_velocities()
    diagram.GetInputPort("cable_velocities").FixValue(context, 0.01 * np.sin(np.arange(m)))
    plant_context = plant.GetMyMutableContextFromRoot(context)
    in_plant.set_pose(plant_context, robot.home.transform())
    plant.SetVelocities(plant_context, 0.05 * np.cos(np.arange(nv)))
    winches = block.winches.GetMyMutableContextFromRoot(context)
    lengths = cable_paths(robot.home.transform(), settings.cable_set(robot)).lengths
    block.winches.hold(winches, lengths, np.zeros(m))
    simulator = Simulator(diagram, context)
    ResetIntegratorFromFlags(simulator, "runge_kutta3", STEP).set_fixed_step_mode(True)
    states, tensions = [], []
    for look in range(1, LOOKS + 1):
        simulator.AdvanceTo(look * DURATION / LOOKS)
        states.append(context.get_continuous_state_vector().CopyToVector())
        forces = diagram.GetSubsystemContext(block.forces, context)
        tensions.append(np.array(block.GetOutputPort("tensions").Eval(forces)))
    return np.array(states), np.array(tensions)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("name", ROBOTS)
def test_it_moves_as_one_platform_does(name, model):
    ours, before = (states_of(name, MODELS[model], as_routes) for as_routes in (True, False))
    for mine, theirs in zip(ours, before, strict=True):
        assert np.all(np.isfinite(theirs))
        np.testing.assert_array_equal(mine, theirs)
    assert np.max(before[1]) > 0.1  # N: some cable pulls at one of the looks
