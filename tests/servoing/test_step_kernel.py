"""The compiled step of a servo against the law as one writes it in NumPy."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.poses import adjoint, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.servoing.controller import ServoController
from cdpr_drake.servoing.feature_plan import FeaturePlan
from cdpr_drake.servoing.packed_features_kernel import CENTER, MARKS, call_features, feature_kernel
from cdpr_drake.servoing.servo_law import AdaptiveGain, ServoLaw, YawTask
from cdpr_drake.servoing.servo_task import BelievedRobot, make_task
from cdpr_drake.servoing.target_motion import MotionFilter
from cdpr_drake.servoing.visual_features import (
    CameraPoseFeatures,
    CircleFeatures,
    DepthRule,
    HybridFeatures,
    ObjectPoseFeatures,
    PointFeatures,
    WithoutFeature,
    columns,
    packed_sighting,
    sighting,
)
from cdpr_drake.vision.dots import DotTarget
from cdpr_drake.vision.rings import CircleTarget

ROUNDING = 1e-10
"""Sums and factors in another order, times the condition of interaction matrices of 1e4; relative
to numbers of about one."""

PERIOD = 0.04
DOTS, RING = DotTarget(0.06), CircleTarget(0.06)
X_CdO = pose_from_angles(np.array([0.0, 0.0, 0.09]), np.radians([180.0, 0.0, 180.0]))
X_WP0 = pose_from_angles(np.array([0.112, -0.032, 0.301]), np.radians([-12.0, -10.0, 5.0]))
X_WO = pose_from_angles(np.array([0.2, -0.19, 0.0]), np.array([0.0, 0.0, 0.2]))
X_PO = pose_from_angles(np.array([0.02, 0.01, -0.05]), np.radians([180.0, 5.0, 10.0]))
DEPTHS = [DepthRule(), DepthRule("desired"), DepthRule("constant", 0.3)]

FEATURES = {
    "pbvs": (lambda X, depth: ObjectPoseFeatures(X), DOTS),
    "pbvs-line": (lambda X, depth: CameraPoseFeatures(X), DOTS),
    "2.5d": (HybridFeatures, DOTS),
    "ibvs": (lambda X, depth: PointFeatures(DOTS.points, X, depth), DOTS),
    "ibvs, three": (lambda X, depth: PointFeatures(DOTS.points, X, depth, (3, 0, 2)), DOTS),
    "circles": (lambda X, depth: CircleFeatures(RING.radii, X, depth), RING),
    "five": (lambda X, depth: WithoutFeature(HybridFeatures(X, depth)), DOTS),
    "without the first": (lambda X, depth: WithoutFeature(ObjectPoseFeatures(X), 0), DOTS),
}


class ReadableServo:
    """One task of the law of `ServoController`, without plan and compensation, in NumPy."""

    def __init__(self, law, task, robot, X_PO):
        self.law, self.task, self.robot, self.X_PO = law, task, robot, X_PO
        self.began, self.toward = None, None

    def step(self, seen, X_WP, time):
        law, task = self.law, self.task
        s, L_now = task.features.evaluate(seen)
        L = {"current": L_now, "desired": task.L_desired}.get(
            task.interaction, (L_now + task.L_desired) / 2.0
        )
        e = s - task.final
        gain = law.gain(e)
        X_PC, sign = self.robot.X_PC, 1.0
        if self.X_PO is not None:
            X_CO = RigidTransform(np.column_stack([seen.R_CO, seen.p_CO]))
            X_PC, sign = self.X_PO @ X_CO.inverse(), -1.0
        motions = list(self.robot.motions)
        if len(motions) < 6:
            basis = sign * adjoint(X_PC.inverse())[:, motions]
            V_C = basis @ np.linalg.pinv(L @ basis) @ (-gain * e)
        else:
            U, S, Vt = np.linalg.svd(L, full_matrices=False)
            U, S, Vt = (part[..., : task.features.rank] for part in (U, S, Vt.T))
            inverse = Vt @ np.diag(1.0 / S) @ U.T
            V_C = -gain * inverse @ e
            if law.yaw is not None:
                R = X_WP.rotation().matrix()
                off = law.yaw.angle - np.arctan2(R[1, 0], R[0, 0])
                V_2 = np.zeros(6)
                turn = law.yaw.gain * np.arctan2(np.sin(off), np.cos(off))
                V_2[:3] = sign * turn * (R @ X_PC.rotation().matrix())[2]
                V_C = V_C + (np.eye(6) - inverse @ L) @ V_2
        if self.began is None:
            self.began, self.toward = time, -V_C / gain
        if law.sigma is not None:
            V_C = V_C + gain * self.toward * np.exp(-law.sigma * (time - self.began))
        V_P = sign * adjoint(X_PC) @ V_C
        if len(motions) < 6:
            V_P = np.where(np.isin(np.arange(6), motions), V_P, 0.0)
        R = X_WP.rotation().matrix()
        V_WP = np.concatenate([R @ V_P[:3], R @ V_P[3:]])
        rates = cable_jacobian(X_WP, self.robot.cables) @ V_WP
        share = 1.0 / max(1.0, np.max(np.abs(rates)) / self.robot.cable_speed)
        return share * rates, share * V_P, e, gain


def random_law(rng):
    span = rng.choice([0.0, 1.5])
    return ServoLaw(
        AdaptiveGain(2.0, 2.0 - span, 30.0),
        sigma=rng.choice([None, 4.0]),
        yaw=YawTask(0.3, 0.7) if rng.uniform() < 0.5 else None,
        frame=rng.choice(["platform", "base"]),
    )


def scene(seed, name):
    """A servo of one task, its readable form, and what the camera sees from a pose."""
    rng = np.random.default_rng(seed)
    make, target = FEATURES[name]
    robot = load_robot(["acrobot_small", "caroca"][seed % 2])
    cables = robot.cable_set() if seed % 3 else robot.cable_set().without_pulleys()
    law, in_world = random_law(rng), seed % 4 == 3
    planar = seed % 5 == 4 and law.frame == "platform"
    X_PC = robot.camera_mount("onboard").pose.transform() if not in_world else RigidTransform()
    believed = BelievedRobot(
        cables, X_PC, X_WP0, (2, 3, 4) if planar else (0, 1, 2, 3, 4, 5),
        rng.choice([0.02, 10.0]),
    )  # fmt: skip

    def see(X_WP):
        X_CO = (X_WP @ X_PC).inverse() @ X_WO
        if in_world:  # in front of a camera somewhere
            X_CO = pose_from_angles([0.01, 0.02, 0.4], [3.0, 0.1, 0.0]) @ X_WP @ X_PO
        return sighting(X_CO, target.ideal_marks(X_CO))

    features = make(X_CdO, DEPTHS[seed % 3])
    interaction = ["current", "desired", "mean"][rng.integers(3)]
    desired = sighting(X_CdO, target.ideal_marks(X_CdO))
    task = make_task(features, desired, interaction)
    on_platform = X_PO if in_world else None
    servo = ServoController(law, [task], believed, PERIOD, on_platform)
    return servo, ReadableServo(law, task, believed, on_platform), see, rng


@pytest.mark.parametrize("name", FEATURES)
@pytest.mark.parametrize("seed", range(12))
def test_the_kernel_is_the_law(name, seed):
    servo, readable, see, rng = scene(seed, name)
    memory = servo.fresh_memory()
    for k in range(4):
        p = X_WP0.translation() + rng.uniform(-0.02, 0.02, 3)
        X_WP = pose_from_angles(p, rng.uniform(-0.2, 0.2, 3))
        R, time = X_WP.rotation().matrix(), 1.0 + k * PERIOD
        command, memory = servo.step(memory, see(X_WP), R, p, time)
        rates, V_P, e, gain = readable.step(see(X_WP), X_WP, time)
        for found, expected in (
            (command.cable_velocities, rates), (command.V_P, V_P), (command.error, e),
            (command.gain, gain),
        ):  # fmt: skip
            scale = max(1.0, np.max(np.abs(expected)))
            np.testing.assert_allclose(found, expected, rtol=0.0, atol=ROUNDING * scale)


@pytest.mark.parametrize("name", FEATURES)
@pytest.mark.parametrize("depth", DEPTHS)
def test_packed_features_are_the_features(name, depth):
    make, target = FEATURES[name]
    features = make(X_CdO, depth)
    packed = features.packed()
    X_CO = pose_from_angles(np.array([0.02, -0.03, 0.2]), np.radians([170.0, 8.0, 160.0]))
    seen = sighting(X_CO, target.ideal_marks(X_CO))
    s, L = np.empty(packed.size), np.empty((packed.size, 6))
    given = packed_sighting(seen)
    np.testing.assert_array_equal(given[:CENTER], columns(X_CO))
    np.testing.assert_array_equal(given[MARKS:], np.ravel(seen.marks))
    packed.kernel(packed.numbers, given, s, L)
    if packed.dropped >= 0:
        s, L = np.delete(s, packed.dropped), np.delete(L, packed.dropped, axis=0)
    expected = features.evaluate(seen)
    np.testing.assert_allclose(s, expected[0], rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(L, expected[1], rtol=1e-13, atol=1e-13)
    assert feature_kernel(packed.kernel) != 0
    assert call_features is not None


class InPython(ObjectPoseFeatures):
    """Features of which there is no kernel, as a user may write them."""

    def packed(self):
        return None


def test_features_plans_and_compensation_in_python_meet_the_same_law():
    """Ways past the compiled features; at the first step, before anything moves, all agree."""
    seen = sighting(X_CO := (X_WP0 @ X_CdO.inverse()), DOTS.ideal_marks(X_CO))
    robot = load_robot("acrobot_small")
    believed = BelievedRobot(robot.cable_set(), RigidTransform([0.0, 0.01, 0.0]), X_WP0)
    law = ServoLaw(AdaptiveGain(2.0, 0.3, 30.0), 4.0)
    desired = sighting(X_CdO, DOTS.ideal_marks(X_CdO))
    plain = make_task(ObjectPoseFeatures(X_CdO), desired)
    over = replace(plain, plan=FeaturePlan(plain.final, duration=1e-9))
    python = make_task(InPython(X_CdO), desired)
    moving = replace(law, compensation=MotionFilter("difference", 2.0, PERIOD))
    servos = [
        ServoController(a_law, [task], believed, PERIOD)
        for a_law, task in ((law, plain), (law, python), (moving, plain), (law, over))
    ]
    assert [servo.sees_packed for servo in servos] == [True, False, False, False]
    R, p = X_WP0.rotation().matrix(), X_WP0.translation()
    commands = [servo.step(servo.fresh_memory(), seen, R, p, 0.0)[0] for servo in servos[:3]]
    for command in commands[1:]:
        np.testing.assert_allclose(command.V_P, commands[0].V_P, rtol=0.0, atol=ROUNDING)
        np.testing.assert_allclose(
            command.cable_velocities, commands[0].cable_velocities, rtol=0.0, atol=ROUNDING
        )


def test_a_step_leaves_what_it_was_given():
    servo, _, see, _ = scene(0, "pbvs")
    memory, seen = servo.fresh_memory(), see(X_WP0)
    before, given = memory.copy(), packed_sighting(seen)
    servo.step(memory, seen, X_WP0.rotation().matrix(), X_WP0.translation(), 0.0)
    np.testing.assert_array_equal(memory, before)
    np.testing.assert_array_equal(packed_sighting(seen), given)
