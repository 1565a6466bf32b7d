"""Partitioned and switching servoing: their kernels against the laws written by hand, and a camera
that moves as it is told."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform

from cdpr_drake.geometry.poses import exponential, pose_error, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.servoing.combined_features import PartitionedFeatures, SwitchedFeatures
from cdpr_drake.servoing.controller import ServoController
from cdpr_drake.servoing.partitioned_law_kernel import STEEPEST, edge_push
from cdpr_drake.servoing.servo_law import (
    GOALS,
    AdaptiveGain,
    AxisPartition,
    EdgeField,
    ModeSwitching,
    ServoLaw,
)
from cdpr_drake.servoing.servo_task import BelievedRobot, make_task
from cdpr_drake.servoing.visual_features import CameraPoseFeatures, PointFeatures, sighting
from cdpr_drake.vision.dots import DotTarget

PERIOD = 0.04
ROUNDING = 1e-10
"""Another order of sums and factors, times conditions of 1e3, of numbers of about one."""

REACHED = 1e-3
"""Distance [m] and angle [rad] after the time that a run is given."""

RATIO, OVERSHOOT = 1.05, 1.02
"""Bounds as multiples of the start, close to it so that they matter; what one step of 40 ms that is
foreseen to first order may add."""

DOTS = DotTarget(0.06)
X_CdO = pose_from_angles(np.array([0.0, 0.0, 0.3]), np.radians([180.0, 0.0, 180.0]))
ROBOT = load_robot("acrobot_small")
GAIN = AdaptiveGain(1.0, 1.0, 0.0)
EDGES = np.array([-0.4, 0.4, -0.3, 0.3])
FIELD = EdgeField(0.7, 0.1, EDGES)

FEATURES = {
    "ibvs": PointFeatures(DOTS.points, X_CdO),
    "pbvs-line": CameraPoseFeatures(X_CdO),
    "partitioned": PartitionedFeatures(PointFeatures(DOTS.points, X_CdO)),
    "switching": SwitchedFeatures(PointFeatures(DOTS.points, X_CdO)),
}


def see(X_CO):
    return sighting(X_CO, DOTS.ideal_marks(X_CO))


def controller(name, sigma=None, **law):
    """A servo of a platform that is its camera, with cables that are never too fast."""
    believed = BelievedRobot(
        ROBOT.cable_set().without_pulleys(), RigidTransform(), RigidTransform(), cable_speed=1e6
    )
    task = make_task(FEATURES[name], see(X_CdO))
    return ServoController(ServoLaw(GAIN, sigma, **law), [task], believed, PERIOD)


def fly(servo, X_CO, duration):
    """Poses of the object in a camera that does what it is told, and memories after each step."""
    memory, poses, memories = servo.fresh_memory(), [X_CO], []
    for k in range(round(duration / PERIOD)):
        command, memory = servo.step(memory, see(X_CO), np.eye(3), np.zeros(3), k * PERIOD)
        X_CO = exponential(-PERIOD * command.V_P) @ X_CO
        poses.append(X_CO)
        memories.append(memory)
    return poses, np.array(memories)


def turned(angle, depth=0.3):
    return pose_from_angles(np.array([0.0, 0.0, depth]), np.array([np.pi, 0.0, np.pi - angle]))


starts = st.builds(
    lambda x, y, z, a, b, c: pose_from_angles(
        np.array([x * z, y * z, z]), np.array([np.pi + a, b, np.pi + c])
    ),
    st.floats(-0.15, 0.15),
    st.floats(-0.1, 0.1),
    st.floats(0.25, 0.7),
    st.floats(-0.4, 0.4),
    st.floats(-0.4, 0.4),
    st.floats(-1.5, 1.5),
)


@settings(max_examples=25)
@given(X_CO=starts, with_field=st.booleans(), goal=st.sampled_from(GOALS))
def test_the_partitioned_twist_is_the_law(X_CO, with_field, goal):
    """As published, v_xy = L_xy^+ (-lambda e + F - L_z v_z); for goals that turn L_xy^+ (-lambda e'
    + F). By NumPy's pseudo-inverse."""
    partition = AxisPartition(0.5, FIELD if with_field else None, goal)
    servo = controller("partitioned", partition=partition)
    command, _ = servo.step(servo.fresh_memory(), see(X_CO), np.eye(3), np.zeros(3), 0.0)
    s, L = FEATURES["partitioned"].evaluate(see(X_CO))
    e = s - FEATURES["partitioned"].evaluate(see(X_CdO))[0]
    wz, vz = -0.5 * e[-2] / L[-2, 2], -0.5 * e[-1] / L[-1, 5]
    F = np.zeros(8)
    if with_field:
        for i, x in enumerate(s[:8]):
            for room, sign in ((x - EDGES[2 * (i % 2)], 1), (EDGES[2 * (i % 2) + 1] - x, -1)):
                if room < FIELD.distance:
                    steep = min(FIELD.distance / max(room, 1e-9), STEEPEST)
                    F[i] += sign * FIELD.gain * FIELD.distance * (steep - 1) * steep**2
        vz += L[:8, 5] @ F / (L[:8, 5] @ L[:8, 5])
        F = np.tile(F.reshape(4, 2).mean(axis=0), 4)
    rest = -e[:8] + F - L[:8, 2] * wz - L[:8, 5] * vz
    if goal == "turned":
        cosine, sine = np.exp(e[-1]) * np.cos(e[-2]), np.exp(e[-1]) * np.sin(e[-2])
        turned_goal = np.array([[cosine, -sine], [sine, cosine]]) @ (s - e)[:8].reshape(4, 2).T
        rest = turned_goal.T.ravel() - s[:8] + F
    expected = np.empty(6)
    expected[[0, 1, 3, 4]] = np.linalg.pinv(L[:8][:, [0, 1, 3, 4]]) @ rest
    expected[[2, 5]] = wz, vz
    scale = max(1.0, np.max(np.abs(expected)))
    np.testing.assert_allclose(command.V_P, expected, rtol=0.0, atol=ROUNDING * scale)
    np.testing.assert_allclose(command.error, e, rtol=0.0, atol=ROUNDING)


def test_the_field_is_the_slope_of_its_potential():
    """U = eta rho_0^4 (1 / rho - 1 / rho_0)^2 / 2 by central differences; nothing beyond rho_0."""
    law = controller("partitioned", partition=AxisPartition(1.0, FIELD))._law
    step, rho_0 = 1e-6, FIELD.distance
    for rho in (0.055, 0.07, 0.09):
        up, down = (
            0.5 * FIELD.gain * rho_0**4 * (1.0 / r - 1.0 / rho_0) ** 2
            for r in (rho + step, rho - step)
        )
        slope = (up - down) / (2.0 * step)
        assert edge_push(law, EDGES[0] + rho, *EDGES[:2]) == pytest.approx(-slope, rel=1e-6)
        assert edge_push(law, EDGES[1] - rho, *EDGES[:2]) == pytest.approx(slope, rel=1e-6)
    assert edge_push(law, 0.0, *EDGES[:2]) == 0.0
    assert edge_push(law, EDGES[0], *EDGES[:2]) == pytest.approx(4.0 * FIELD.gain * rho_0)


def test_half_a_turn_makes_ibvs_retreat_and_not_the_partition():
    """Points turned by 180 deg would go through the middle: IBVS sends the camera away from it. The
    published partition does not retreat, but rounding is enough for it to tilt; goals that turn
    leave nothing to tilt for."""
    start = turned(np.pi - 1e-3)
    runs = {"ibvs": fly(controller("ibvs"), start, 6.0)[0]}
    for goal in GOALS:
        servo = controller("partitioned", partition=AxisPartition(goal=goal))
        runs[goal] = fly(servo, start, 12.0)[0]
    depths = {name: np.array([X.translation()[2] for X in poses]) for name, poses in runs.items()}
    tilts = {name: max(np.arccos(min(-X.rotation().matrix()[2, 2], 1.0)) for X in poses)
             for name, poses in runs.items()}  # fmt: skip
    assert np.max(depths["ibvs"]) > 1.5
    assert np.max(depths["fixed"]) < 0.301
    assert tilts["fixed"] > np.radians(30.0)
    assert tilts["turned"] < 1e-6
    np.testing.assert_allclose(depths["turned"], 0.3, atol=1e-6)
    assert max(pose_error(runs["turned"][-1], X_CdO)) < REACHED


@settings(max_examples=8)
@given(X_CO=starts, goal=st.sampled_from(GOALS))
def test_partitioned_servoing_arrives(X_CO, goal):
    partition = AxisPartition(goal=goal)
    poses, _ = fly(controller("partitioned", 4.0, partition=partition), X_CO, 12.0)
    assert max(pose_error(poses[-1], X_CdO)) < REACHED


def test_the_field_keeps_points_in_the_image():
    """On the way from here a corner leaves the image, unless a field pushes it back."""
    p, angles = [0.1422, -0.1342, 0.613], [np.pi - 0.403, -0.15, np.pi - 1.026]
    start, room = pose_from_angles(np.array(p), np.array(angles)), {}
    for name, field in (("without", None), ("with", FIELD)):
        servo = controller("partitioned", 4.0, partition=AxisPartition(1.0, field, "turned"))
        poses, _ = fly(servo, start, 16.0)
        marks = np.array([DOTS.ideal_marks(X) for X in poses])
        room[name] = np.min(EDGES[1::2] - np.max(np.abs(marks), axis=(0, 2)))
        assert max(pose_error(poses[-1], X_CdO)) < 5.0 * REACHED
    assert room["without"] < 0.0 < room["with"]


def functions(X_CO):
    s, _ = FEATURES["switching"].evaluate(see(X_CO))
    e = s - FEATURES["switching"].evaluate(see(X_CdO))[0]
    return 0.5 * float(e[:6] @ e[:6]), 0.5 * float(e[6:] @ e[6:])


def random_start(rng):
    x, y, a, b = rng.uniform([-0.15, -0.1, -0.4, -0.4], [0.15, 0.1, 0.4, 0.4])
    z, c = rng.uniform([0.25, -3.1], [0.7, 3.1])
    return pose_from_angles(np.array([x * z, y * z, z]), np.array([np.pi + a, b, np.pi + c]))


def test_switching_keeps_both_functions_within_their_bounds_and_arrives():
    """L_P and L_I are computed here from true poses, at every step; seven of the starts switch."""
    rng, switched = np.random.default_rng(0), 0
    for number in range(24):
        X_CO, first = random_start(rng), ("pose", "image")[number % 2]
        choice = ModeSwitching(bound_ratio=RATIO, first=first, dwell=0.0)
        servo = controller("switching", switching=choice)
        poses, memories = fly(servo, X_CO, 14.0)
        values = np.array([functions(X) for X in poses])
        bounds = RATIO * values[0]
        assert np.all(values <= OVERSHOOT * bounds)
        assert max(pose_error(poses[-1], X_CdO)) < 2.0 * REACHED
        logged = np.array([servo.mode(memory) for memory in memories])
        np.testing.assert_allclose(logged[:, 2:4], values[:-1], rtol=1e-6, atol=1e-12)
        np.testing.assert_allclose(logged[:, 4:], np.tile(bounds, (len(logged), 1)))
        switched += logged[-1, 1] > 0.0
    assert switched >= 2


def test_switching_ends_the_retreat_of_ibvs():
    """Image-based at first, it would retreat; the bound of L_P lets the pose take over."""
    start = turned(np.pi - 1e-3)
    servo = controller("switching", 4.0, switching=ModeSwitching(bound_ratio=1.05))
    poses, memories = fly(servo, start, 10.0)
    mode = np.array([servo.mode(memory) for memory in memories])
    assert mode[0, 0] == 1.0
    assert mode[-1, 1] >= 1.0
    assert 0.0 in mode[:, 0]
    assert max(X.translation()[2] for X in poses) < 1.0
    assert max(pose_error(poses[-1], X_CdO)) < REACHED


@pytest.mark.parametrize("mode", ["pose", "image"])
def test_without_a_switch_each_controller_is_the_plain_one(mode):
    start = pose_from_angles(np.array([0.02, 0.01, 0.4]), np.radians([175.0, 5.0, 190.0]))
    plain = controller({"pose": "pbvs-line", "image": "ibvs"}[mode], 4.0)
    wide = ModeSwitching(pose_bound=1e9, image_bound=1e9, first=mode)
    both = controller("switching", 4.0, switching=wide)
    for X, Y in zip(fly(plain, start, 1.0)[0], fly(both, start, 1.0)[0], strict=True):
        assert max(pose_error(X, Y)) < ROUNDING


def test_switches_are_apart_and_counted_over_losses():
    """Bounds that nothing can keep: it switches as often as it may, and no more."""
    dwell = 5.0 * PERIOD
    hopeless = ModeSwitching(pose_bound=1e-12, image_bound=1e-12, dwell=dwell)
    servo = controller("switching", switching=hopeless)
    start = pose_from_angles(np.array([0.02, 0.01, 0.4]), np.radians([175.0, 5.0, 190.0]))
    _, memories = fly(servo, start, 4.0)
    count = np.array([servo.mode(memory)[1] for memory in memories])
    at = np.flatnonzero(np.diff(count, prepend=0.0))
    assert np.all(np.diff(at) >= 5)
    kept = servo.mode(servo.lose(memories[-1]))
    assert kept[1] == count[-1]
