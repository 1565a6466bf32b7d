"""Contact of a platform with its world against closed forms: depth, weight, friction, pushing."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.systems.worlds.contact import contact_law, contact_step
from cdpr_drake.systems.worlds.meters import ContactMeter
from cdpr_drake.systems.worlds.settings import ObstacleJoint, ObstacleMotion, ObstacleWaypoint
from tests.systems.worlds.world_bench import ContactSettings, FreePlatform, obstacle, world_of

G = 9.81

DEPTH = 1e-7
"""Of the depth at rest, which is reached within the simulated time [m]."""

CREEP = 2e-3
"""What friction that fades with the speed of slipping adds to the way of sliding, relative."""

DRIVEN = 1e-8
"""How far a driven body may be off its motion [m]: the error of its integration, and 2.5 nm for
each kN that presses on it."""


@pytest.fixture(scope="module")
def robot():
    return load_robot("acrobot_large")


def forces(platform):
    meter = ContactMeter(platform.in_plant)
    context = meter.CreateDefaultContext()
    meter.GetInputPort("contact_results").FixValue(context, platform.contacts())
    return (
        meter.GetOutputPort("contact_force").Eval(context),
        meter.GetOutputPort("contact_count").Eval(context)[0],
    )


@pytest.mark.parametrize("depth", [1e-4, 3e-4])
def test_a_platform_on_four_corners_sinks_in_as_deep_as_asked_for(robot, depth):
    settings = world_of(contact=ContactSettings(penetration=depth))
    platform = FreePlatform(robot, settings, RigidTransform([0.1, 0.2, 0.0]))
    platform.simulator.AdvanceTo(0.15)
    assert platform.pose().translation()[2] == pytest.approx(-depth, abs=DEPTH)
    force, count = forces(platform)
    assert count == 4
    np.testing.assert_allclose(force, [0.0, 0.0, robot.platform.mass * G], atol=1e-3)


def test_a_platform_on_a_table_narrower_than_it_rests_by_hydroelastic_contact(robot):
    table = obstacle("table", "box", (0.0, 0.0, 0.05), size=np.array([0.1, 0.1, 0.1]))
    settings = world_of(table, contact=ContactSettings(model="hydroelastic"))
    platform = FreePlatform(robot, settings, RigidTransform([0.0, 0.0, 0.1001]))
    platform.simulator.AdvanceTo(0.2)
    X_WP = platform.pose()
    # A third of the area bears it: 3.06 times as deep.
    share = 0.1 * 0.1 / (robot.platform.size[0] * robot.platform.size[1])
    assert X_WP.translation()[2] == pytest.approx(0.1 - 1e-4 / share, rel=0.02, abs=1e-5)
    assert X_WP.IsNearlyEqualTo(RigidTransform(X_WP.translation()), 1e-4)
    force, _ = forces(platform)
    np.testing.assert_allclose(force, [0.0, 0.0, robot.platform.mass * G], atol=0.05)


def test_a_platform_that_slides_stops_where_friction_lets_it(robot):
    platform = FreePlatform(
        robot, world_of(contact=ContactSettings()), RigidTransform([0.0, 0.0, -1e-4])
    )
    speed, friction = 0.4, 0.5
    velocities = np.zeros(6)
    velocities[3] = speed
    platform.plant.SetVelocities(platform.plant_context, velocities)
    platform.simulator.AdvanceTo(0.15)
    way = speed**2 / (2.0 * friction * G)
    assert platform.pose().translation()[0] == pytest.approx(way, rel=0.02)


def test_a_moving_obstacle_pushes_the_platform_and_is_not_held_up(robot):
    half = 0.5 * robot.platform.size[0]
    way = Pose(position=np.array([-half - 0.02 + 0.05, 0.0, 0.03]))
    pusher = obstacle(
        "pusher", "box", (-half - 0.02, 0.0, 0.03), size=np.array([0.02, 0.3, 0.05]),
        motion=ObstacleMotion(waypoints=[ObstacleWaypoint(time=0.5, pose=way)]),
    )  # fmt: skip
    platform = FreePlatform(
        robot, world_of(pusher, contact=ContactSettings()), RigidTransform([0.0, 0.0, -1e-4])
    )
    ((body, in_plant),) = platform.world.driver.bodies()
    platform.simulator.AdvanceTo(0.2)
    before = platform.pose().translation()[0]
    platform.simulator.AdvanceTo(0.5)
    # The gap of 1 cm is closed first; then its face leads the platform's.
    assert before < 0.03
    assert platform.pose().translation()[0] >= 0.04 - 2e-3
    X_WB = platform.plant.EvalBodyPoseInWorld(platform.plant_context, in_plant)
    off = X_WB.translation() - body.motion.at(0.5).translation()
    assert np.linalg.norm(off) < DRIVEN


def test_a_driven_body_follows_its_joint(robot):
    swing = ObstacleJoint(
        point=np.array([0.0, 0.0, 2.0]), axis=np.array([0.0, 1.0, 0.0]),
        rate_deg=90.0, amplitude_deg=40.0, period=0.5,
    )  # fmt: skip
    hose = obstacle(
        "hose", "cylinder", (1.0, 0.0, 1.0), (10.0, 20.0, 30.0), radius=0.05, length=1.0,
        motion=ObstacleMotion(joint=swing),
    )  # fmt: skip
    platform = FreePlatform(
        robot, world_of(hose, contact=ContactSettings()), RigidTransform([0.0, 0.0, -1e-4])
    )
    ((body, in_plant),) = platform.world.driver.bodies()
    platform.simulator.AdvanceTo(0.2)
    X_WB = platform.plant.EvalBodyPoseInWorld(platform.plant_context, in_plant)
    assert X_WB.IsNearlyEqualTo(body.motion.at(0.2), DRIVEN)


def test_stiffness_follows_from_mass_and_damping_is_critical(robot):
    law = contact_law(ContactSettings(), robot)
    mass = robot.platform.mass
    assert 4.0 * law.stiffness * 1e-4 == pytest.approx(mass * G)
    damping = 4.0 * law.dissipation * law.stiffness * law.penetration
    assert damping == pytest.approx(2.0 * np.sqrt(4.0 * law.stiffness * mass))


def test_the_step_of_contact_is_that_of_its_vertical_motion_where_that_is_the_fastest(robot):
    """Without friction and damping only three vibrations on four springs are left."""
    law = contact_law(ContactSettings(friction=0.0, dissipation=0.0), robot)
    inertia = platform_inertia(robot).CopyToFullMatrix6()
    x, y = robot.platform.size[:2] / 2.0
    center = robot.center_of_mass()
    moments = np.diag(inertia)[:2] - robot.platform.mass * center[2] ** 2
    squares = 4.0 * law.stiffness * np.array([
        1.0 / robot.platform.mass, y**2 / moments[0], x**2 / moments[1]
    ])  # fmt: skip
    # Runge-Kutta 3 is stable up to sqrt(3) on the imaginary axis; undamped counts as damped by
    # 1 per cent there, which allows for 4 per cent more.
    assert contact_step(robot, law, 0.5, "runge_kutta3") == pytest.approx(
        np.sqrt(3.0) / np.sqrt(np.max(squares)), rel=0.05
    )
