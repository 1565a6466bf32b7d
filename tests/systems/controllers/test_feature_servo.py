"""Pose-based visual servoing: one update against the law, starts, saturation, planar motions."""

import dataclasses

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import adjoint, exponential, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.servoing.controller import ServoController
from cdpr_drake.servoing.pose_features import pose_feature_error, pose_interaction
from cdpr_drake.servoing.servo_law import AdaptiveGain, ServoLaw
from cdpr_drake.servoing.servo_task import BelievedRobot, make_task
from cdpr_drake.servoing.visual_features import ObjectPoseFeatures, sighting
from cdpr_drake.systems.controllers.feature_servo import FeatureServo
from cdpr_drake.vision.apriltags import TagTarget
from cdpr_drake.vision.pinhole import Pinhole

ROUND_OFF = 1e-12
"""Velocities of order one [m/s, rad/s] after a pseudo-inverse of condition about ten."""

DIFFERENCE = 1e-6
"""Central differences with a step of 1e-5 leave the third derivative times 1e-11 and round-off
1e-16 / 1e-5; errors and lengths are of order one."""

STEP = 1e-5

RATE = 25.0
PERIOD = 1.0 / RATE
GAIN = AdaptiveGain(2.0, 0.3, 30.0)
SIGMA = 4.0

TAG = TagTarget(0, 0.06)
PINHOLE = Pinhole(640, 480, 500.0, 500.0, 319.5, 239.5)
X_CdO = pose_from_angles(np.array([0.0, 0.0, 0.09]), np.radians([180.0, 0.0, 180.0]))
X_WP = pose_from_angles(np.array([0.112, -0.032, 0.301]), np.radians([-12.0, -10.0, 0.0]))
X_WO = RigidTransform([0.2209, -0.197, 0.0])


def model_of(name, motions=(0, 1, 2, 3, 4, 5), cable_speed=10.0):
    robot = load_robot(name)
    return BelievedRobot(
        cables=robot.cable_set(),
        X_PC=robot.camera_mount("onboard").pose.transform(),
        X_WP0=robot.home.transform(),
        motions=motions,
        cable_speed=cable_speed,
    )


MODEL = model_of("acrobot_small")
X_CO = (X_WP @ MODEL.X_PC).inverse() @ X_WO


class Bench:
    """A servo with inputs that a test sets, simulated period by period."""

    def __init__(self, model=MODEL, sigma=SIGMA, desired=X_CdO):
        task = make_task(ObjectPoseFeatures(desired), sighting(desired, np.empty(0)))
        controller = ServoController(
            ServoLaw(GAIN, sigma),
            [task],
            model,
            PERIOD,
        )
        self.servo = FeatureServo(controller, TAG, PINHOLE, RATE)
        self.simulator = Simulator(self.servo)
        self._updates = 0

    def see(self, X_CO, X_WP=X_WP, found=1.0):
        """Sets the inputs for the next update."""
        context = self.simulator.get_mutable_context()
        corners = PINHOLE.project(RigidTransform([0.0, 0.0, 1.0]) @ TAG.points).T.ravel()
        for name, value in (
            ("X_CO", Value(X_CO)),
            ("X_WP", Value(X_WP)),
            ("found", [found]),
            ("corners", corners),
        ):
            self.servo.GetInputPort(name).FixValue(context, value)

    def update(self):
        """Performs the next update; returns the output ports' values by name."""
        self.simulator.AdvanceTo((self._updates + 0.5) * PERIOD)
        self._updates += 1
        return {
            name: self.servo.GetOutputPort(name).Eval(self.simulator.get_context()).copy()
            for name in ("cable_velocities", "platform_velocity", "error", "gain")
        }


def abrupt_update(X_CO=X_CO, **settings):
    """The first update of a servo that starts abruptly."""
    bench = Bench(sigma=None, **settings)
    bench.see(X_CO)
    return bench.update()


def seen_after(twist, time, X_CO, X_PC):
    """X_CO when the platform has moved by its constant body twist for some time."""
    return X_PC.inverse() @ exponential(twist * time).inverse() @ X_PC @ X_CO


def test_ports_are_these():
    servo = Bench().servo
    inputs = [servo.get_input_port(i) for i in range(servo.num_input_ports())]
    outputs = [servo.get_output_port(i) for i in range(servo.num_output_ports())]
    assert [(port.get_name(), port.size()) for port in inputs] == [
        ("X_CO", 0),
        ("found", 1),
        ("corners", 8),
        ("X_WP", 0),
    ]
    assert [(port.get_name(), port.size()) for port in outputs] == [
        ("cable_velocities", 8),
        ("platform_velocity", 6),
        ("error", 6),
        ("gain", 1),
    ]


def test_outputs_rest_before_the_first_update():
    bench = Bench()
    context = bench.simulator.get_context()
    for name in ("cable_velocities", "platform_velocity", "error", "gain"):
        assert not np.any(bench.servo.GetOutputPort(name).Eval(context))


def test_the_error_decays_at_the_rate_of_the_gain():
    """de/dt = -lambda e, the derivative by moving the platform as the servo asks."""
    found = abrupt_update()
    twist = found["platform_velocity"]
    after, before = (
        pose_feature_error(seen_after(twist, time, X_CO, MODEL.X_PC), X_CdO)
        for time in (STEP, -STEP)
    )
    expected = -GAIN(found["error"]) * found["error"]
    np.testing.assert_allclose((after - before) / (2.0 * STEP), expected, atol=DIFFERENCE)
    np.testing.assert_array_equal(found["error"], pose_feature_error(X_CO, X_CdO))
    assert found["gain"] == GAIN(found["error"])


def test_cable_velocities_are_the_length_rates_of_that_motion():
    """Over the pulleys, which this model knows."""
    assert MODEL.cables.has_pulleys()
    found = abrupt_update()
    after, before = (
        cable_paths(X_WP @ exponential(found["platform_velocity"] * time), MODEL.cables).lengths
        for time in (STEP, -STEP)
    )
    rates = (after - before) / (2.0 * STEP)
    np.testing.assert_allclose(found["cable_velocities"], rates, atol=DIFFERENCE)


def test_updates_follow_the_formula_of_the_continuous_start():
    """-lambda (L^+ e - L_0^+ e_0 exp(-sigma t)), servoing thesis (1.35), through some updates."""
    bench = Bench()
    at_start = None
    seen = X_CO
    for number in range(5):
        bench.see(seen)
        found = bench.update()
        e = pose_feature_error(seen, X_CdO)
        L = pose_interaction(seen, X_CdO) @ adjoint(MODEL.X_PC.inverse())
        wanted = np.linalg.solve(L, e)
        at_start = wanted if at_start is None else at_start
        expected = -GAIN(e) * (wanted - at_start * np.exp(-SIGMA * number * PERIOD))
        np.testing.assert_allclose(found["platform_velocity"], expected, atol=ROUND_OFF)
        seen = seen_after(expected, PERIOD, seen, MODEL.X_PC)


def test_it_starts_from_rest_and_gains_speed():
    bench = Bench()
    bench.see(X_CO)
    speeds = [np.linalg.norm(bench.update()["cable_velocities"]) for _ in range(10)]
    assert speeds[0] < ROUND_OFF
    assert np.all(np.diff(speeds) > 0.0)


def test_at_the_desired_pose_it_rests():
    found = abrupt_update(X_CO=X_CdO)
    for name in ("cable_velocities", "platform_velocity", "error"):
        assert np.max(np.abs(found[name])) < ROUND_OFF


def test_without_target_it_stops_and_then_starts_again_from_rest():
    bench = Bench()
    bench.see(X_CO)
    for _ in range(5):
        moving = bench.update()
    assert np.linalg.norm(moving["cable_velocities"]) > 0.0

    bench.see(RigidTransform(), found=0.0)
    for _ in range(3):
        stopped = bench.update()
        assert not np.any(stopped["cable_velocities"])
        assert not np.any(stopped["platform_velocity"])
        assert stopped["gain"] == 0.0
        np.testing.assert_array_equal(stopped["error"], moving["error"])  # the last one measured

    bench.see(X_CO)
    again = [bench.update() for _ in range(5)]
    assert np.max(np.abs(again[0]["platform_velocity"])) < ROUND_OFF
    np.testing.assert_allclose(
        again[-1]["platform_velocity"], moving["platform_velocity"], atol=ROUND_OFF
    )


def test_without_sigma_it_starts_at_once():
    """Also after the target was lost."""
    bench = Bench(sigma=None)
    bench.see(X_CO)
    first = bench.update()
    assert np.linalg.norm(first["platform_velocity"]) > 0.0
    bench.see(X_CO, found=0.0)
    bench.update()
    bench.see(X_CO)
    np.testing.assert_array_equal(bench.update()["platform_velocity"], first["platform_velocity"])


def test_saturation_keeps_the_direction():
    free = abrupt_update()
    limit = 0.3 * np.max(np.abs(free["cable_velocities"]))
    found = abrupt_update(model=dataclasses.replace(MODEL, cable_speed=limit))
    assert np.max(np.abs(found["cable_velocities"])) == pytest.approx(limit, rel=ROUND_OFF)
    for name in ("cable_velocities", "platform_velocity"):
        np.testing.assert_allclose(found[name], 0.3 * free[name], atol=ROUND_OFF)


def test_within_the_limit_nothing_is_scaled():
    free = abrupt_update()
    limit = np.max(np.abs(free["cable_velocities"]))
    found = abrupt_update(model=dataclasses.replace(MODEL, cable_speed=limit))
    np.testing.assert_array_equal(found["cable_velocities"], free["cable_velocities"])


def test_the_estimated_pose_turns_the_cables_but_not_the_twist():
    """The twist in P follows from the camera alone; the cables need to know where P is."""
    bench = Bench(sigma=None)
    bench.see(X_CO, X_WP=X_WP @ pose_from_angles(np.array([0.05, 0.0, 0.0]), np.zeros(3)))
    elsewhere = bench.update()
    here = abrupt_update()
    np.testing.assert_array_equal(elsewhere["platform_velocity"], here["platform_velocity"])
    assert np.max(np.abs(elsewhere["cable_velocities"] - here["cable_velocities"])) > 1e-4


def test_a_planar_robot_moves_in_its_plane_only():
    """Three motions suffice for an error in the plane, which then decays as in space."""
    model = model_of("planar", motions=(2, 3, 4))
    desired = pose_from_angles(np.array([0.0, 0.0, 0.3]), np.radians([180.0, 0.0, 0.0]))
    X_WP = pose_from_angles(np.array([-0.12, 0.1, 0.3]), np.radians([0.0, 0.0, -15.0]))
    X_CO = (X_WP @ model.X_PC).inverse() @ RigidTransform([0.03, 0.02, 0.0])
    bench = Bench(model=model, sigma=None, desired=desired)
    bench.see(X_CO, X_WP=X_WP)
    found = bench.update()
    twist = found["platform_velocity"]
    assert not np.any(twist[[0, 1, 5]])
    assert np.all(twist[[2, 3, 4]] != 0.0)
    assert found["cable_velocities"].shape == (4,)
    after, before = (
        pose_feature_error(seen_after(twist, time, X_CO, model.X_PC), desired)
        for time in (STEP, -STEP)
    )
    expected = -GAIN(found["error"]) * found["error"]
    np.testing.assert_allclose((after - before) / (2.0 * STEP), expected, atol=DIFFERENCE)
