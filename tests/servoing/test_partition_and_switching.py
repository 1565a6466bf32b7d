"""Partitioned and switching servoing: their kernels against the laws written by hand, and a camera
that moves as it is told."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform

from cdpr_drake.features import (
    CameraPoseFeatures,
    PartitionedFeatures,
    PointFeatures,
    SwitchedFeatures,
    sighting,
)
from cdpr_drake.models import load_robot
from cdpr_drake.servoing import (
    AdaptiveGain,
    AxisPartition,
    BelievedRobot,
    EdgeField,
    ModeSwitching,
    ServoController,
    ServoLaw,
    make_task,
)
from cdpr_drake.servoing.partition_kernel import STEEPEST, edge_push
from cdpr_drake.spatial import exponential, pose_error, pose_from_angles
from cdpr_drake.vision import DotTarget

PERIOD = 0.04
ROUNDING = 1e-10
"""Another order of sums and factors, times conditions of 1e3, of numbers of about one."""

REACHED = 1e-3
"""Distance [m] and angle [rad] after the time that a run is given."""

DOTS = DotTarget(0.06)
X_CdO = pose_from_angles(np.array([0.0, 0.0, 0.3]), np.radians([180.0, 0.0, 180.0]))
ROBOT = load_robot("acrobot_small")
GAIN = AdaptiveGain(1.0, 1.0, 0.0)
EDGES = np.array([-0.4, 0.4, -0.3, 0.3])
FIELD = EdgeField(0.7, 0.1, EDGES)

FEATURES = {
    "ibvs": PointFeatures(DOTS.points, X_CdO),
    "pbvs-line": CameraPoseFeatures(X_CdO),
    "partitioned": PartitionedFeatures(DOTS.points, X_CdO),
    "switching": SwitchedFeatures(DOTS.points, X_CdO),
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
@given(X_CO=starts, with_field=st.booleans())
def test_the_partitioned_twist_is_the_published_law(X_CO, with_field):
    """v_xy = L_xy^+ (-lambda e + F - L_z v_z), by NumPy's pseudo-inverse."""
    partition = AxisPartition(0.5, FIELD if with_field else None)
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
    rest = -e[:8] + F - L[:8, 2] * wz - L[:8, 5] * vz
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
    for rho in (0.02, 0.05, 0.09):
        up, down = (
            0.5 * FIELD.gain * rho_0**4 * (1.0 / r - 1.0 / rho_0) ** 2
            for r in (rho + step, rho - step)
        )
        slope = (up - down) / (2.0 * step)
        assert edge_push(law, EDGES[0] + rho, *EDGES[:2]) == pytest.approx(-slope, rel=1e-6)
        assert edge_push(law, EDGES[1] - rho, *EDGES[:2]) == pytest.approx(slope, rel=1e-6)
    assert edge_push(law, 0.0, *EDGES[:2]) == 0.0
    assert np.isfinite(edge_push(law, EDGES[0], *EDGES[:2]))


def test_half_a_turn_makes_ibvs_retreat_and_not_the_partition():
    """Points turned by 180 deg would go through the middle: IBVS sends the camera away from it."""
    start = turned(np.pi - 1e-3)
    far, near = (
        fly(controller(name, **law), start, 6.0)[0]
        for name, law in (("ibvs", {}), ("partitioned", {"partition": AxisPartition()}))
    )
    assert max(X.translation()[2] for X in far) > 1.5
    assert max(X.translation()[2] for X in near) == pytest.approx(0.3, abs=1e-6)
    assert max(pose_error(near[-1], X_CdO)) < 10.0 * REACHED


@settings(max_examples=8)
@given(X_CO=starts)
def test_partitioned_servoing_arrives(X_CO):
    poses, _ = fly(controller("partitioned", 4.0, partition=AxisPartition()), X_CO, 12.0)
    assert max(pose_error(poses[-1], X_CdO)) < REACHED


def test_the_field_keeps_points_in_the_image():
    """A turn takes a corner out beyond an edge; with a field the camera steps back first."""
    start = pose_from_angles(np.array([0.15, 0.0, 0.45]), np.radians([180.0, 25.0, 60.0]))
    room = {}
    for name, field in (("without", None), ("with", FIELD)):
        servo = controller("partitioned", 4.0, partition=AxisPartition(1.0, field))
        poses, _ = fly(servo, start, 12.0)
        marks = np.array([DOTS.ideal_marks(X) for X in poses])
        room[name] = np.min(EDGES[1::2] - np.max(np.abs(marks), axis=(0, 2)))
        assert max(pose_error(poses[-1], X_CdO)) < REACHED
    assert room["with"] > room["without"]


def functions(X_CO):
    s, _ = FEATURES["switching"].evaluate(see(X_CO))
    e = s - FEATURES["switching"].evaluate(see(X_CdO))[0]
    return 0.5 * float(e[:6] @ e[:6]), 0.5 * float(e[6:] @ e[6:])


@settings(max_examples=12)
@given(X_CO=starts, first=st.sampled_from(["pose", "image"]))
def test_switching_keeps_both_functions_within_their_bounds_and_arrives(X_CO, first):
    """L_P and L_I are computed here from true poses, at every step."""
    servo = controller("switching", switching=ModeSwitching(bound_ratio=1.5, first=first))
    poses, memories = fly(servo, X_CO, 12.0)
    values = np.array([functions(X) for X in poses])
    assert np.all(values <= 1.5 * values[0] * (1.0 + 1e-9))
    assert max(pose_error(poses[-1], X_CdO)) < REACHED
    logged = np.array([servo.mode(memory) for memory in memories])
    np.testing.assert_allclose(logged[:, 2:4], values[:-1], rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(logged[:, 4:], np.tile(1.5 * values[0], (len(logged), 1)))
    assert np.all(np.diff(logged[:, 1]) >= 0.0)


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
