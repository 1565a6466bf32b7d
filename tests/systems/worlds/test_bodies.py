"""Bodies of a world against closed forms: distances, contact, shapes of files, and motions."""

from pathlib import Path

import numpy as np
import pytest
from pydrake.geometry import Box, Mesh
from pydrake.math import RigidTransform, RollPitchYaw

from cdpr_drake.errors import WorldError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import rotation_vector
from cdpr_drake.models.robot_in_plant import platform_box, platform_inertia
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.systems.worlds.clearances import WorldClearances
from cdpr_drake.systems.worlds.contact import contact_law, contact_step
from cdpr_drake.systems.worlds.meters import ContactMeter
from cdpr_drake.systems.worlds.model_files import mesh_parts, model_parts
from cdpr_drake.systems.worlds.motions import JointedBody, PathBody, SteadyBody
from cdpr_drake.systems.worlds.settings import ObstacleJoint, ObstacleMotion, ObstacleWaypoint
from cdpr_drake.systems.worlds.world import make_world
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from cdpr_drake.workspaces.cable_distance_kernel import boxes_distance
from cdpr_drake.workspaces.cable_interference import box_row
from tests.systems.worlds.world_bench import ContactSettings, FreePlatform, obstacle, world_of

CLOSEST = 2e-6
"""Of distances of boxes by Drake, whose iterations end there [m]."""

SAMPLED = 2e-5
"""Of the nearest of many points on a cable [m], which are 0.1 mm apart."""

X_WP = RigidTransform(RollPitchYaw(0.2, -0.3, 0.5), [0.05, -0.02, 0.5])


@pytest.fixture(scope="module")
def robot():
    return load_robot("acrobot_large")


def measured(robot, *obstacles, ground=None, time=0.0, X_WP=X_WP):
    world = make_world(world_of(*obstacles, ground=ground), robot)
    clearances = WorldClearances(robot, world, robot.cable_set())
    return clearances.platform(X_WP, time), clearances.cables(X_WP, time)


def platform_row(robot, X_WP):
    X_PBox, box = platform_box(robot)
    X = X_WP @ X_PBox
    return box_row(X.translation(), box.size(), X.rotation().matrix())


def test_boxes_are_as_far_as_the_exact_kernel_says(robot):
    draws = np.random.default_rng(1)
    for _ in range(5):
        size, angles = draws.uniform(0.05, 0.3, 3), draws.uniform(-180.0, 180.0, 3)
        place = X_WP.translation() + draws.uniform(0.2, 0.4, 3) * draws.choice([-1, 1], 3)
        box = obstacle("box", "box", place, angles, size=size)
        (gap,), _ = measured(robot, box)
        X_WB = box.pose.transform()
        row = box_row(X_WB.translation(), size, X_WB.rotation().matrix())
        exact = boxes_distance(platform_row(robot, X_WP), row, np.empty((2, 3)))
        assert gap == pytest.approx(exact, abs=CLOSEST)


def test_a_sphere_is_as_far_as_its_centre_from_the_box_less_its_radius(robot):
    ball = obstacle("ball", "sphere", (0.3, 0.2, 0.6), radius=0.07)
    (gap,), _ = measured(robot, ball)
    X_PBox, box = platform_box(robot)
    p = (X_WP @ X_PBox).inverse() @ np.array([0.3, 0.2, 0.6])
    over = np.maximum(np.abs(p) - 0.5 * box.size(), 0.0)
    assert gap == pytest.approx(np.linalg.norm(over) - 0.07, abs=CLOSEST)


def test_the_ground_is_as_far_as_the_lowest_corner(robot):
    (gap,), (cables,) = measured(robot, ground=-0.1)
    row = platform_row(robot, X_WP)
    R = row[:9].reshape(3, 3)
    lowest = row[11] - np.sum(np.abs(R[2]) * row[12:])
    assert gap == pytest.approx(lowest + 0.1, abs=1e-12)
    ends = (X_WP @ robot.cable_set().p_PB)[2]
    assert cables == pytest.approx(np.min(ends) + 0.1 - 0.001, abs=1e-12)


def test_overlap_is_negative_and_a_body_that_moves_is_where_it_is_then(robot):
    motion = ObstacleMotion(velocity=np.array([0.0, 0.0, -0.1]))
    ball = obstacle("ball", "sphere", (0.05, -0.02, 1.0), radius=0.1, motion=motion)
    (early,), _ = measured(robot, ball, time=0.0)
    (late,), _ = measured(robot, ball, time=4.0)
    assert early > 0.0 > late


@pytest.mark.parametrize(
    ("kind", "rest"),
    [
        ("box", {"size": np.array([0.1, 0.2, 0.05])}),
        ("sphere", {"radius": 0.06}),
        ("cylinder", {"radius": 0.04, "length": 0.3}),
    ],
)
def test_cables_are_as_far_as_the_nearest_of_many_points_on_them(robot, kind, rest):
    body = obstacle("body", kind, (0.35, -0.3, 0.8), (20.0, 30.0, -50.0), **rest)
    _, (gap,) = measured(robot, body)
    X_WB = body.pose.transform()
    starts = cable_paths(X_WP, robot.cable_set()).p_WT
    ends = X_WP @ robot.cable_set().p_PB
    share = np.linspace(0.0, 1.0, 10_001)
    points = starts[:, :, None] + (ends - starts)[:, :, None] * share
    x, y, z = np.abs(X_WB.inverse() @ points.reshape(3, -1))
    if kind == "box":
        over = np.maximum(np.array([x, y, z]) - 0.5 * rest["size"][:, None], 0.0)
        least = np.min(np.linalg.norm(over, axis=0))
    elif kind == "sphere":
        least = max(np.min(np.sqrt(x * x + y * y + z * z)) - rest["radius"], 0.0)
    else:
        side = np.maximum(np.hypot(x, y) - rest["radius"], 0.0)
        least = np.min(np.hypot(side, np.maximum(z - 0.5 * rest["length"], 0.0)))
    assert gap == pytest.approx(least - 0.5 * robot.cable.diameter, abs=SAMPLED)


def test_a_cable_passes_through_an_obstacle_and_the_clearance_tells(robot):
    anchor = X_WP @ robot.cable_set().p_PB[:, 0]
    middle = 0.5 * (robot.cable_set().p_WA[:, 0] + anchor)
    for kind, rest in (("sphere", {"radius": 0.05}), ("cylinder", {"radius": 0.05, "length": 0.1})):
        _, (gap,) = measured(robot, obstacle("body", kind, middle, **rest))
        assert gap == pytest.approx(-0.5 * robot.cable.diameter)


G = 9.81

DEPTH = 1e-7
"""Of the depth at rest, which is reached within the simulated time [m]."""

CREEP = 2e-3
"""What friction that fades with the speed of slipping adds to the way of sliding, relative."""

DRIVEN = 1e-8
"""How far a driven body may be off its motion [m]: the error of its integration, and 2.5 nm for
each kN that presses on it."""


def on_ground(robot, *obstacles, at=(0.0, 0.0, -1e-4), contact=None):
    """A platform that no cable holds, above or on its world."""
    settings = world_of(*obstacles, contact=contact or ContactSettings())
    return FreePlatform(robot, settings, RigidTransform(at))


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
    contact = ContactSettings(penetration=depth)
    platform = on_ground(robot, at=(0.1, 0.2, 0.0), contact=contact)
    platform.simulator.AdvanceTo(0.15)
    assert platform.pose().translation()[2] == pytest.approx(-depth, abs=DEPTH)
    force, count = forces(platform)
    assert count == 4
    np.testing.assert_allclose(force, [0.0, 0.0, robot.platform.mass * G], atol=1e-3)


def test_a_platform_on_a_table_narrower_than_it_rests_by_hydroelastic_contact(robot):
    table = obstacle("table", "box", (0.0, 0.0, 0.05), size=np.array([0.1, 0.1, 0.1]))
    contact = ContactSettings(model="hydroelastic")
    platform = on_ground(robot, table, at=(0.0, 0.0, 0.1001), contact=contact)
    platform.simulator.AdvanceTo(0.2)
    X_WP = platform.pose()
    # A third of the area bears it: 3.06 times as deep.
    share = 0.1 * 0.1 / (robot.platform.size[0] * robot.platform.size[1])
    assert X_WP.translation()[2] == pytest.approx(0.1 - 1e-4 / share, rel=0.02, abs=1e-5)
    assert X_WP.IsNearlyEqualTo(RigidTransform(X_WP.translation()), 1e-4)
    force, _ = forces(platform)
    np.testing.assert_allclose(force, [0.0, 0.0, robot.platform.mass * G], atol=0.05)


def test_a_platform_that_slides_stops_where_friction_lets_it(robot):
    platform = on_ground(robot)
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
    platform = on_ground(robot, pusher)
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
    platform = on_ground(robot, hose)
    ((body, in_plant),) = platform.world.driver.bodies()
    platform.simulator.AdvanceTo(0.05)
    X_WB = platform.plant.EvalBodyPoseInWorld(platform.plant_context, in_plant)
    assert X_WB.IsNearlyEqualTo(body.motion.at(0.05), DRIVEN)


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


GREY = np.array([0.5, 0.5, 0.5, 1.0])

CUBE = "\n".join(
    [
        *(f"v {x} {y} {z}" for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)),
        "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n",
    ]
)
"""A cube of 2 units."""

MODEL = """<sdf version="1.7"><model name="gate"><pose>5 6 7 0 0 0.3</pose>
<link name="post"><pose>0.5 0 0 0 0 0</pose>
<visual name="v"><geometry><box><size>1 2 3</size></box></geometry>
<material><diffuse>1 0 0 1</diffuse></material></visual>
<collision name="c"><pose>0 0 1 0 0 0</pose><geometry><box><size>1 2 3</size></box></geometry>
</collision></link></model></sdf>"""


def test_a_mesh_is_solid_and_as_large_as_its_scale_says(tmp_path, robot):
    cube = str(tmp_path / "cube.obj")
    Path(cube).write_text(CUBE)
    (part,) = mesh_parts(cube, 0.1, GREY)
    assert isinstance(part.shape, Mesh)
    assert part.solid
    assert part.shown
    body = obstacle("cube", "mesh", (0.0, 0.0, 0.1), file=cube, scale=0.1)
    (gap,), cables = measured(robot, body, X_WP=RigidTransform([0.0, 0.0, 0.5]))
    assert gap == pytest.approx(0.3, abs=2e-6)
    assert np.isnan(cables)


def test_a_model_has_its_shapes_in_the_frame_of_the_model(tmp_path):
    path = tmp_path / "gate.sdf"
    path.write_text(MODEL)
    seen, solid = model_parts(str(path), GREY)
    assert isinstance(seen.shape, Box)
    assert (seen.shown, seen.solid, solid.shown, solid.solid) == (True, False, False, True)
    np.testing.assert_allclose(seen.X_BG.translation(), [0.5, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(solid.X_BG.translation(), [0.5, 0.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(seen.color, [1.0, 0.0, 0.0, 1.0])


PLANE = """<sdf version="1.7"><model name="m"><static>true</static><link name="l">
<collision name="c"><geometry><plane><normal>0 0 1</normal></plane></geometry></collision>
</link></model></sdf>"""
EMPTY = '<sdf version="1.7"><model name="m"><link name="l"/></model></sdf>'

UNREADABLE = {
    "there is no such file": ("none.sdf", None),
    "accepted: a file .sdf or .urdf": ("model.blend", ""),
    "no model that can be read": ("bad.sdf", "<sdf"),
    "without shapes": ("empty.sdf", EMPTY),
    "found a plane": ("plane.sdf", PLANE),
    "no mesh that can be read": ("bad.obj", "nothing"),
}


@pytest.mark.parametrize("words", UNREADABLE)
def test_files_that_cannot_be_are_refused_in_one_line(tmp_path, words):
    name, content = UNREADABLE[words]
    path = tmp_path / name
    if content is not None:
        path.write_text(content)
    is_mesh = name.endswith(".obj")
    read, more = (mesh_parts, (1.0, GREY)) if is_mesh else (model_parts, (GREY,))
    with pytest.raises(WorldError, match=words) as problem:
        read(str(path), *more)
    assert "\n" not in str(problem.value)
    assert len(str(problem.value)) <= 500


STEP = 1e-4
"""Of central differences [s]; their error is its square times third derivatives of order 100."""

DIFFERENCES = 1e-5
"""What that and rounding leave [m/s, rad/s and per s^2]."""

START = RigidTransform(RollPitchYaw(0.3, -0.2, 0.5), [1.0, -0.5, 0.7])
END = RigidTransform(RollPitchYaw(-0.4, 0.6, 0.1), [0.2, 0.4, 1.1])

MOTIONS = {
    "steady": SteadyBody(START, np.array([0.3, -0.1, 0.2]), np.array([0.5, 0.2, -0.4])),
    "waypoints": PathBody(PoseTrajectory((START, END), (1.5,))),
    "repeated": PathBody(PoseTrajectory((START, END, START), (0.4, 0.3)), repeat=True),
    "joint": JointedBody(
        START, np.array([0.5, 0.5, 2.0]), np.array([0.0, 3.0, 1.0]),
        rate=0.7, amplitude=0.4, period=1.3,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", MOTIONS)
def test_velocity_and_acceleration_are_derivatives_of_the_pose(name):
    motion, time, h = MOTIONS[name], 0.83, STEP
    before, now, after = (motion.at(time + k * h) for k in (-1, 0, 1))
    row = motion.motion(time)
    np.testing.assert_allclose(row[4:7], now.translation(), atol=1e-12)
    v = (after.translation() - before.translation()) / (2.0 * h)
    turned = rotation_vector(after.rotation() @ before.rotation().inverse())
    np.testing.assert_allclose(row[7:10], turned / (2.0 * h), atol=DIFFERENCES)
    np.testing.assert_allclose(row[10:13], v, atol=DIFFERENCES)
    rates = (motion.motion(time + h)[7:13] - motion.motion(time - h)[7:13]) / (2.0 * h)
    np.testing.assert_allclose(row[13:], rates, atol=DIFFERENCES * 10.0)
    assert motion.is_moving()


def test_what_rests_does_not_move():
    still = SteadyBody(START, np.zeros(3), np.zeros(3))
    assert not still.is_moving()
    assert not JointedBody(
        START, np.zeros(3), np.ones(3), rate=0.0, amplitude=0.0, period=1.0
    ).is_moving()
    np.testing.assert_array_equal(still.motion(3.0)[7:], np.zeros(12))


def test_a_joint_keeps_the_distance_from_its_axis():
    motion, point = MOTIONS["joint"], np.array([0.5, 0.5, 2.0])
    axis = np.array([0.0, 3.0, 1.0]) / np.sqrt(10.0)
    start = START.translation() - point
    for time in (0.0, 0.4, 2.7):
        arm = motion.at(time).translation() - point
        np.testing.assert_allclose(
            [arm @ axis, np.linalg.norm(arm)], [start @ axis, np.linalg.norm(start)], atol=1e-12
        )
