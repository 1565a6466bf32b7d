"""Servo blocks update by update: finite differences of errors and lengths, the printed law."""

import dataclasses

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import adjoint, exponential, pose_from_angles
from cdpr_drake.geometry.straight_cables import length_jacobian
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.servoing.controller import ServoController
from cdpr_drake.servoing.pose_features import pose_feature_error, pose_interaction
from cdpr_drake.servoing.servo_law import AdaptiveGain, ServoLaw
from cdpr_drake.servoing.servo_task import BelievedRobot, make_task
from cdpr_drake.servoing.visual_features import ObjectPoseFeatures, sighting
from cdpr_drake.systems.controllers.feature_servo import FeatureServo, control_step
from cdpr_drake.systems.controllers.tension_distributor import TensionDistributor
from cdpr_drake.systems.diagrams.beliefs import believed_robot
from cdpr_drake.systems.diagrams.controller import make_controller
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.vision.apriltags import TagTarget
from cdpr_drake.vision.pinhole import Pinhole
from tests.systems.controllers.controller_cases import PROJECTED, in_plant, ports

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
OUTPUTS = ("cable_velocities", "platform_velocity", "error", "gain")

TAG = TagTarget(0, 0.06)
PINHOLE = Pinhole(640, 480, 500.0, 500.0, 319.5, 239.5)
X_CdO = pose_from_angles(np.array([0.0, 0.0, 0.09]), np.radians([180.0, 0.0, 180.0]))
X_WP = pose_from_angles(np.array([0.112, -0.032, 0.301]), np.radians([-12.0, -10.0, 0.0]))
X_WO = RigidTransform([0.2209, -0.197, 0.0])


def model_of(name, motions=(0, 1, 2, 3, 4, 5)):
    robot = load_robot(name)
    return BelievedRobot(
        cables=robot.cable_set(),
        X_PC=robot.camera_mount("onboard").pose.transform(),
        X_WP0=robot.home.transform(),
        motions=motions,
        cable_speed=10.0,
    )


MODEL = model_of("acrobot_small")
X_CO = (X_WP @ MODEL.X_PC).inverse() @ X_WO


class Bench:
    """A servo with inputs that a test sets, simulated period by period."""

    def __init__(self, model=MODEL, sigma=SIGMA, desired=X_CdO):
        task = make_task(ObjectPoseFeatures(desired), sighting(desired, np.empty(0)))
        controller = ServoController(ServoLaw(GAIN, sigma), [task], model, PERIOD)
        self.servo = FeatureServo(controller, TAG, PINHOLE, RATE)
        self.simulator = Simulator(self.servo)
        self._updates = 0

    def outputs(self):
        context = self.simulator.get_context()
        return {name: self.servo.GetOutputPort(name).Eval(context).copy() for name in OUTPUTS}

    def update(self, X_CO=X_CO, X_WP=X_WP, found=1.0):
        """Outputs by name after the next update, which sees these inputs."""
        context = self.simulator.get_mutable_context()
        corners = PINHOLE.project(RigidTransform([0.0, 0.0, 1.0]) @ TAG.points).T.ravel()
        inputs = {"X_CO": Value(X_CO), "X_WP": Value(X_WP), "found": [found], "corners": corners}
        for name, value in inputs.items():
            self.servo.GetInputPort(name).FixValue(context, value)
        self.simulator.AdvanceTo((self._updates + 0.5) * PERIOD)
        self._updates += 1
        return self.outputs()


def abrupt_update(X_CO=X_CO, X_WP=X_WP, **settings):
    """The first update of a servo that starts abruptly."""
    return Bench(sigma=None, **settings).update(X_CO, X_WP)


def sight_after(twist, time, X_CO, X_PC):
    """X_CO when the platform has moved by its constant body twist for some time."""
    return X_PC.inverse() @ exponential(twist * time).inverse() @ X_PC @ X_CO


def error_rate(twist, X_CO, model, desired):
    after, before = (
        pose_feature_error(sight_after(twist, time, X_CO, model.X_PC), desired)
        for time in (STEP, -STEP)
    )
    return (after - before) / (2.0 * STEP)


def scenario_servo(name, *changes):
    return build_visual_servo(load_scenario(name, [PROJECTED, *changes])).servo


BLOCKS = {
    "servo": (
        lambda: Bench().servo,
        {"X_CO": 0, "found": 1, "corners": 8, "X_WP": 0},
        {"cable_velocities": 8, "platform_velocity": 6, "error": 6, "gain": 1},
    ),
    "plan": (
        lambda: scenario_servo("acrobot_pbvs", "open_loop={duration: 4}"),
        {"X_CO": 0, "found": 1, "corners": 8, "X_WP": 0},
        {"cable_velocities": 8, "platform_velocity": 6, "error": 6, "gain": 1, "X_WP_planned": 0},
    ),
    "circles": (
        lambda: scenario_servo("acrobot_circles"),
        {"X_CO": 0, "found": 1, "ellipses": 10, "X_WP": 0},
        {"cable_velocities": 8, "platform_velocity": 6, "error": 10, "gain": 1},
    ),
    "distributor": (
        lambda: TensionDistributor(in_plant("acrobot_large")),
        {"platform_state": 13, "desired_wrench": 6},
        {"tensions": 8, "feasible": 1, "failures": 1},
    ),
}


@pytest.mark.parametrize("name", BLOCKS)
def test_ports_of_a_block_are_public(name):
    make, inputs, outputs = BLOCKS[name]
    found = ports(make())
    assert [list(group.items()) for group in found] == [list(inputs.items()), list(outputs.items())]


def test_outputs_rest_before_the_first_update():
    assert not any(np.any(value) for value in Bench().outputs().values())


PLANAR = model_of("planar", (2, 3, 4))
X_PLANE = pose_from_angles(np.array([-0.12, 0.1, 0.3]), np.radians([0.0, 0.0, -15.0]))
PLANE = (
    PLANAR,
    pose_from_angles(np.array([0.0, 0.0, 0.3]), np.radians([180.0, 0.0, 0.0])),
    X_PLANE,
    (X_PLANE @ PLANAR.X_PC).inverse() @ RigidTransform([0.03, 0.02, 0.0]),
)


@pytest.mark.parametrize(
    ("model", "desired", "X_WP", "X_CO"),
    [(MODEL, X_CdO, X_WP, X_CO), PLANE],
    ids=["space", "plane"],
)
def test_the_error_decays_at_the_rate_of_the_gain(model, desired, X_WP, X_CO):
    """de/dt = -lambda e by moving the platform; three motions suffice for an error in a plane."""
    found = abrupt_update(X_CO, X_WP, model=model, desired=desired)
    twist, error = found["platform_velocity"], found["error"]
    rate = error_rate(twist, X_CO, model, desired)
    np.testing.assert_allclose(rate, -GAIN(error) * error, atol=DIFFERENCE)
    np.testing.assert_array_equal(error, pose_feature_error(X_CO, desired))
    assert found["gain"] == GAIN(error)
    assert found["cable_velocities"].shape == (model.cables.count,)
    moves = np.isin(np.arange(6), model.motions)
    np.testing.assert_array_equal(twist != 0.0, moves)


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
    bench, at_start, seen = Bench(), None, X_CO
    for number in range(5):
        found = bench.update(seen)
        e = pose_feature_error(seen, X_CdO)
        L = pose_interaction(seen, X_CdO) @ adjoint(MODEL.X_PC.inverse())
        wanted = np.linalg.solve(L, e)
        at_start = wanted if at_start is None else at_start
        expected = -GAIN(e) * (wanted - at_start * np.exp(-SIGMA * number * PERIOD))
        np.testing.assert_allclose(found["platform_velocity"], expected, atol=ROUND_OFF)
        seen = sight_after(expected, PERIOD, seen, MODEL.X_PC)


def ibvs_in_numpy(scenario, target, pinhole, X_CO, marks):
    """Cable velocities of IBVS by four corners, without a continuous start [m/s]."""
    robot, c = load_robot(scenario.robot), scenario.controller
    cables, X_WP = robot.cable_set().without_pulleys(), scenario.initial_pose.transform()
    uv = marks.reshape(-1, 2).T
    points = np.array([(uv[0] - pinhole.cx) / pinhole.fx, (uv[1] - pinhole.cy) / pinhole.fy])
    rows = []
    for (x, y), Z in zip(points.T, (X_CO @ target.points)[2], strict=True):
        rows.append([x * y, -(1 + x * x), y, -1 / Z, 0.0, x / Z])
        rows.append([1 + y * y, -x * y, -x, 0.0, -1 / Z, y / Z])
    error = (points - target.ideal_marks(scenario.desired.transform())).T.ravel()
    gain = AdaptiveGain(c.lambda_0, c.lambda_infinity, c.lambda_slope)(error)
    V_P = adjoint(robot.camera_mount("onboard").pose.transform()) @ (
        -gain * np.linalg.pinv(np.array(rows)) @ error
    )
    R = X_WP.rotation().matrix()
    V_WP = np.concatenate([R @ V_P[:3], R @ V_P[3:]])
    rates = length_jacobian(X_WP, cables.p_WA, cables.p_PB) @ V_WP
    return rates * min(1.0, robot.winch.rated_cable_speed() / np.max(np.abs(rates)))


def test_a_step_of_ibvs_is_that_of_plain_numpy():
    scenario = load_scenario("acrobot_ibvs", ["controller.sigma=null"])
    robot, X_WP = load_robot(scenario.robot), scenario.initial_pose.transform()
    mount, target = robot.camera_mount("onboard"), scenario.target.target()
    pinhole = load_camera(mount.model).pinhole(640, 480)
    X_CO = (X_WP @ mount.pose.transform()).inverse() @ scenario.target.path().at(0.0)
    marks = target.project(X_CO, pinhole, 0.0, np.random.default_rng(0))
    controller = make_controller(scenario, believed_robot(scenario, robot), target, pinhole)
    command, _ = control_step(
        controller, controller.fresh_memory(), (target, pinhole), (X_CO, marks), X_WP, 0.5
    )
    expected = ibvs_in_numpy(scenario, target, pinhole, X_CO, marks)
    assert np.max(np.abs(expected)) > 1e-2
    np.testing.assert_allclose(command.cable_velocities, expected, rtol=0.0, atol=1e-10)


def test_a_servo_starts_from_rest_and_gains_speed():
    bench = Bench()
    speeds = [np.linalg.norm(bench.update()["cable_velocities"]) for _ in range(10)]
    assert speeds[0] < ROUND_OFF
    assert np.all(np.diff(speeds) > 0.0)


def test_at_the_desired_pose_a_servo_rests():
    found = abrupt_update(X_CO=X_CdO)
    for name in OUTPUTS[:3]:
        assert np.max(np.abs(found[name])) < ROUND_OFF


def test_without_target_a_servo_stops_and_then_starts_again_from_rest():
    bench = Bench()
    moving = [bench.update() for _ in range(5)][-1]
    assert np.linalg.norm(moving["cable_velocities"]) > 0.0
    for _ in range(3):
        stopped = bench.update(RigidTransform(), found=0.0)
        for name in ("cable_velocities", "platform_velocity", "gain"):
            assert not np.any(stopped[name]), name
        np.testing.assert_array_equal(stopped["error"], moving["error"])  # the last one measured
    again = [bench.update() for _ in range(5)]
    assert np.max(np.abs(again[0]["platform_velocity"])) < ROUND_OFF
    np.testing.assert_allclose(
        again[-1]["platform_velocity"], moving["platform_velocity"], atol=ROUND_OFF
    )


def test_without_sigma_a_servo_starts_at_once_also_after_a_loss():
    bench = Bench(sigma=None)
    first = bench.update()["platform_velocity"]
    assert np.linalg.norm(first) > 0.0
    bench.update(found=0.0)
    np.testing.assert_array_equal(bench.update()["platform_velocity"], first)


@pytest.mark.parametrize("share", [0.3, 1.0])
def test_saturation_keeps_the_direction_and_scales_nothing_within_the_limit(share):
    free = abrupt_update()
    limit = share * np.max(np.abs(free["cable_velocities"]))
    found = abrupt_update(model=dataclasses.replace(MODEL, cable_speed=limit))
    assert np.max(np.abs(found["cable_velocities"])) == pytest.approx(limit, rel=ROUND_OFF)
    tolerance = 0.0 if share == 1.0 else ROUND_OFF
    for name in OUTPUTS[:2]:
        np.testing.assert_allclose(found[name], share * free[name], rtol=0.0, atol=tolerance)


def test_the_estimated_pose_turns_the_cables_but_not_the_twist():
    """The twist in P follows from the camera alone; the cables need to know where P is."""
    elsewhere = abrupt_update(X_WP=X_WP @ pose_from_angles(np.array([0.05, 0.0, 0.0]), np.zeros(3)))
    here = abrupt_update()
    np.testing.assert_array_equal(elsewhere["platform_velocity"], here["platform_velocity"])
    assert np.max(np.abs(elsewhere["cable_velocities"] - here["cable_velocities"])) > 1e-4
