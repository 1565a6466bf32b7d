"""What an inertial measurement unit reads of motions that are known, and how its errors grow."""

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.math import SpatialAcceleration, SpatialVelocity
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RevoluteJoint, SpatialInertia, UnitInertia

from cdpr_drake.geometry.poses import rotation_from_vector
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.sensor_catalogue import load_inertial_sensor
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings, WinchSettings
from cdpr_drake.systems.sensors.inertial_sensor import InertialMotion, InertialSensor
from tests.motion.small_robots import MOTIONS, small_robot

EXACT = 1e-12
G = np.array([0.0, 0.0, -9.81])
IDEAL = load_inertial_sensor("ideal")
X_PS = RigidTransform(RollPitchYaw(0.3, -0.2, 0.9), np.array([0.1, -0.05, 0.2]))


def truth_of(X_PS, X_WP, w, alpha, a, v=(0.0, 0.0, 0.0)):
    """What a sensor without errors reads of a platform that moves so."""
    sensor = InertialSensor(IDEAL, X_PS, body=1, gravity=G)
    own = sensor.CreateDefaultContext()
    sensor.GetInputPort("X_WP").FixValue(own, X_WP)
    moving = [SpatialVelocity.Zero(), SpatialVelocity(w=w, v=v)]
    sensor.GetInputPort("body_velocities").FixValue(own, Value[list[SpatialVelocity]](moving))
    bodies = [SpatialAcceleration.Zero(), SpatialAcceleration(alpha=alpha, a=a)]
    sensor.GetInputPort("body_accelerations").FixValue(
        own, Value[list[SpatialAcceleration]](bodies)
    )
    return sensor.truth(own)


def test_at_rest_it_reads_gravity_upwards():
    X_WP = RigidTransform(RollPitchYaw(0.5, 0.1, -2.0), np.array([1.0, 2.0, 3.0]))
    found = truth_of(X_PS, X_WP, np.zeros(3), np.zeros(3), np.zeros(3))
    R_WS = (X_WP @ X_PS).rotation()
    np.testing.assert_allclose(R_WS @ found[:3], -G, atol=EXACT)
    np.testing.assert_allclose(found[3:], np.zeros(3), atol=EXACT)


def test_in_free_fall_it_reads_nothing():
    found = truth_of(RigidTransform(), RigidTransform(), np.zeros(3), np.zeros(3), G)
    np.testing.assert_allclose(found, np.zeros(6), atol=EXACT)


def test_on_a_circle_it_reads_what_pulls_it_in():
    """Rotation about z at 3 rad/s, the sensor 0.4 m away, turned so that x looks outwards."""
    w, r = 3.0, 0.4
    X = RigidTransform(
        RotationMatrix.MakeZRotation(0.7), r * np.array([np.cos(0.7), np.sin(0.7), 0])
    )
    found = truth_of(X, RigidTransform(), [0, 0, w], np.zeros(3), np.zeros(3))
    np.testing.assert_allclose(found, [-(w**2) * r, 0.0, 9.81, 0.0, 0.0, w], atol=EXACT)
    faster = truth_of(X, RigidTransform(), [0, 0, w], [0, 0, 5.0], np.zeros(3))
    np.testing.assert_allclose(faster - found, [0.0, 5.0 * r, 0, 0, 0, 0], atol=EXACT)


def test_on_a_pendulum_it_reads_the_rod():
    """Drake's accelerations of a point mass on a rod: along it g cos + w^2 l, across it nothing."""
    length, angle, rate = 0.8, 0.6, 1.7
    plant = MultibodyPlant(0.0)
    end = np.array([0.0, 0.0, -length])
    body = plant.AddRigidBody("bob", SpatialInertia(2.0, end, UnitInertia.PointMass(end)))
    joint = plant.AddJoint(
        RevoluteJoint("hinge", plant.world_frame(), body.body_frame(), np.array([0.0, 1.0, 0.0]))
    )
    plant.Finalize()
    context = plant.CreateDefaultContext()
    joint.set_angle(context, angle)
    joint.set_angular_rate(context, rate)
    accelerations = plant.get_body_spatial_accelerations_output_port().Eval(context)
    A = accelerations[body.index()]
    X_BS = RigidTransform(end)
    X_WB = plant.EvalBodyPoseInWorld(context, body)
    found = truth_of(X_BS, X_WB, [0, rate, 0], A.rotational(), A.translational())
    along = 9.81 * np.cos(angle) + rate**2 * length
    np.testing.assert_allclose(found, [0.0, 0.0, along, 0.0, rate, 0.0], atol=1e-9)


def accelerations_of(kind, robot, settings, commands, X_WP, twist):
    block = kind(robot, settings)
    context = block.CreateDefaultContext()
    block.set_at_equilibrium(context, X_WP)
    for port in range(block.num_input_ports()):
        name = block.get_input_port(port).get_name()
        if name not in ("commanded_length_rates", "applied_wrench"):
            block.get_input_port(port).FixValue(context, commands)
    if kind is CableRobot:
        plant = block.GetMutableSubsystemContext(block.plant, context)
        block.plant.SetVelocities(plant, twist)
    else:
        own = block.GetMutableSubsystemContext(block.motion, context)
        state = block.motion.state(own).copy()
        n = len(block.GetOutputPort("platform_state").Eval(context))
        state[n - len(twist) : n] = twist
        block.motion.set_state(own, state)
    number = int(block.in_plant.body_index)
    A = block.GetOutputPort("body_accelerations").Eval(context)[number]
    V = block.GetOutputPort("body_velocities").Eval(context)[number]
    return np.concatenate([A.rotational(), A.translational(), V.rotational(), V.translational()])


@pytest.mark.parametrize(
    ("name", "model", "winches"),
    [
        ("acrobot_small", "kelvin_voigt", WinchSettings()),
        ("acrobot_small", "catenary", WinchSettings(kind="motor")),
        ("planar", "kelvin_voigt", WinchSettings()),
        ("slope", "kelvin_voigt", WinchSettings()),
        ("oblique_body", "kelvin_voigt", WinchSettings()),
        ("tilted_gravity", "kelvin_voigt", WinchSettings()),
    ],
)
def test_both_engines_give_the_same_acceleration(name, model, winches):
    robot = small_robot(name) if name in MOTIONS else load_robot(name)
    settings = CableRobotSettings(winches=winches, cables=CableSettings(model=model))
    commands = 0.05 * np.linspace(-1.0, 1.0, len(robot.cables))
    X_WP = robot.home.transform()
    twist = np.linspace(-0.2, 0.3, robot.joint().num_velocities)
    found, exact = (
        accelerations_of(kind, robot, settings, commands, X_WP, twist)
        for kind in (CompiledCableRobot, CableRobot)
    )
    assert np.linalg.norm(exact) > 0.1
    np.testing.assert_allclose(found, exact, atol=1e-9 * np.linalg.norm(exact))


def readings(model, seed, count):
    """Samples of a sensor at rest, shape (count, 13)."""
    sensor = InertialSensor(model, RigidTransform(), body=1, gravity=G, seed=seed, rate=100.0)
    sample, found = sensor.nothing(), []
    for number in range(1, count + 1):
        sample = sensor.next_sample(sample, np.zeros(6), number)
        found.append(sample)
    return np.array(found)


def test_white_noise_and_walk_are_those_of_the_densities():
    """Over many seeds: noise by root of the rate, biases by root of the time."""
    model, count = load_inertial_sensor("adis16448"), 101
    runs = np.array([readings(model, seed, count) for seed in range(120)])
    noise = runs[:, :, :6] - runs[:, :, 6:12]
    density = np.repeat([model.accelerometer_noise, model.gyroscope_noise], 3)
    np.testing.assert_allclose(np.std(noise, axis=(0, 1)), density * 10.0, rtol=0.03)
    walked = runs[:, -1, 6:12] - runs[:, 0, 6:12]
    walk = np.repeat([model.accelerometer_walk, model.gyroscope_walk], 3)
    spread = np.std(walked.reshape(-1, 2, 3), axis=(0, 2)) / walk[[0, 3]]
    np.testing.assert_allclose(spread, np.ones(2), rtol=5.0 / np.sqrt(2.0 * 360.0))
    start = np.std(runs[:, 0, 6:12].reshape(-1, 2, 3), axis=(0, 2))
    np.testing.assert_allclose(
        start, [model.accelerometer_bias, model.gyroscope_bias], rtol=5.0 / np.sqrt(2.0 * 360.0)
    )


def test_seeds_repeat_and_a_sample_taken_twice_does_not_walk_twice():
    model = load_inertial_sensor("adis16448")
    np.testing.assert_array_equal(readings(model, 5, 20), readings(model, 5, 20))
    assert not np.array_equal(readings(model, 5, 2), readings(model, 6, 2))
    sensor = InertialSensor(model, RigidTransform(), body=1, gravity=G, seed=5)
    once = sensor.next_sample(sensor.nothing(), np.zeros(6), 1)
    np.testing.assert_array_equal(sensor.next_sample(once, np.zeros(6), 1), once)


def test_readings_end_at_the_limits():
    model = load_inertial_sensor("adis16448")
    sensor = InertialSensor(model, RigidTransform(), body=1, gravity=G)
    found = sensor.next_sample(sensor.nothing(), np.array([1e3, -1e3, 0, 1e3, 0, -1e3]), 1)[:6]
    assert found[0] == model.accelerometer_limit
    assert found[1] == -model.accelerometer_limit
    assert (found[3], found[5]) == (model.gyroscope_limit, -model.gyroscope_limit)


def test_what_it_adds_up_is_the_motion_without_gravity():
    """A turn at a constant rate and a push, at the second of the sensor's readings and the last."""
    model = load_inertial_sensor("ideal")
    sensor = InertialMotion(model, RigidTransform(), body=1, gravity=G, rate=100.0)
    rate, push, sample = np.array([0.3, -0.2, 0.5]), np.array([0.4, 0.1, -0.2]), sensor.nothing()
    for number in range(1, 12):
        time = 0.01 * (number - 1)
        R = rotation_from_vector(rate * time).matrix()
        moment = np.concatenate([R.T @ (push - G), rate])
        sample = sensor.next_sample(
            sample, np.concatenate([moment, R.ravel(), push * time]), number
        )
    turn, velocity, position = sample[13:22], sample[22:25], sample[25:28]
    np.testing.assert_allclose(turn.reshape(3, 3), R, atol=1e-12)
    np.testing.assert_allclose(velocity, (push - G) * 0.1, atol=1e-12)
    np.testing.assert_allclose(position, (push - G) * 0.005, atol=1e-12)
    assert sample[31] == pytest.approx(0.1)
