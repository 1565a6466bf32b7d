"""The compiled step of a servo against the laws as one writes them in NumPy; gains, least squares
and saturation by their properties."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform

from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.poses import adjoint, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.numerics.linear_algebra_kernel import least_squares
from cdpr_drake.servoing.controller import ServoController
from cdpr_drake.servoing.feature_plan import FeaturePlan
from cdpr_drake.servoing.partitioned_law_kernel import STEEPEST, edge_push
from cdpr_drake.servoing.servo_law import (
    GOALS,
    AdaptiveGain,
    AxisPartition,
    EdgeField,
    ServoLaw,
    YawTask,
    saturation_share,
)
from cdpr_drake.servoing.servo_task import BelievedRobot, make_task
from cdpr_drake.servoing.target_motion import MotionFilter
from cdpr_drake.servoing.visual_features import (
    DepthRule,
    ObjectPoseFeatures,
    packed_sighting,
)
from tests.servoing.servo_cases import MAKERS, PACKED, PERIOD, SMALL, frontal, seen

ROUNDING = 1e-12  # a pseudo-inverse of a well conditioned 6 x 6 matrix
PSEUDO_INVERSE = 1e-6  # two factorizations; random matrices, rarely worse than 1e5 conditioned
KERNEL = 1e-10  # another order of sums, times conditions of 1e4, relative to numbers of about one
SLOPE = 1e-4  # relative; the step times the curvature, which is slope / span
STEP = 1e-6

# Gains.

gains = st.builds(
    lambda low, span, slope: AdaptiveGain(low + span, low, slope),
    st.floats(0.05, 2.0), st.floats(0.1, 5.0), st.floats(0.1, 30.0),
)  # fmt: skip


@given(gains, st.floats(0.0, 5.0), st.floats(0.0, 5.0))
def test_the_gain_falls_from_its_limit_at_zero_with_its_slope_to_the_other(gain, a, b):
    """The slope is a forward difference: at 0 the norm has no derivative on the other side."""
    assert gain(np.zeros(6)) == pytest.approx(gain.at_zero, rel=ROUNDING)
    assert gain(np.full(6, 1e6)) == pytest.approx(gain.at_infinity, rel=ROUNDING)
    slope = (gain(np.array([STEP])) - gain(np.zeros(1))) / STEP
    assert slope == pytest.approx(-gain.slope, rel=SLOPE * max(1.0, gain.slope))
    near, far = (gain(np.array([x])) for x in sorted([a, b]))
    assert gain.at_infinity <= far <= near <= gain.at_zero * (1.0 + ROUNDING)
    both = gain(np.array([0.6 * a, 0.8 * a]))
    assert both == pytest.approx(gain(np.array([-a])), rel=ROUNDING)
    assert AdaptiveGain(gain.at_zero, gain.at_zero, gain.slope)(np.array([a])) == gain.at_zero


# Least squares.


@given(st.integers(0, 2**32 - 1), st.integers(3, 10))
def test_least_squares_are_the_pseudo_inverse_s(seed, features):
    random = np.random.default_rng(seed)
    matrix, rate = random.standard_normal((features, 6)), random.standard_normal(features)
    v, free = least_squares(matrix, rate, 6)
    inverse = np.linalg.pinv(matrix)
    np.testing.assert_allclose(v, inverse @ rate, rtol=0.0, atol=PSEUDO_INVERSE * np.abs(v).max())
    np.testing.assert_allclose(free, np.eye(6) - inverse @ matrix, atol=PSEUDO_INVERSE)


@pytest.mark.parametrize("features", [6, 8])
@pytest.mark.parametrize("power", [2.0, 7.0, 8.5, 8.9, 9.1, 11.0])
def test_what_counts_is_decided_by_singular_values(features, power):
    random = np.random.default_rng(int(10.0 * power))
    U = np.linalg.qr(random.normal(size=(features, 6)))[0]
    V = np.linalg.qr(random.normal(size=(6, 6)))[0]
    S = 10.0 ** -np.linspace(0.0, power, 6)
    matrix, rate = np.ascontiguousarray(U * S @ V.T), random.normal(size=features)
    counts = S > 1e-9
    v, free = least_squares(matrix, rate, 6)
    expected = V[:, counts] @ (U[:, counts].T @ rate / S[counts])
    # Rounding of the matrix alone moves what is sought by the condition number times itself.
    rounding = 1e-14 * S[0] / S[counts][-1]
    assert np.linalg.norm(v - expected) <= 10.0 * rounding * np.linalg.norm(expected)
    np.testing.assert_allclose(free, V[:, ~counts] @ V[:, ~counts].T, atol=1e-14 + rounding)


@pytest.mark.parametrize(
    ("diagonal", "rank"), [([3.0, 2.0, 1.0, 1e-7], 3), ([1.0, 1e-12], 2)], ids=["rank", "round-off"]
)
def test_singular_values_beyond_the_rank_or_of_round_off_count_as_zero(diagonal, rank):
    """Where features hardly show a motion, the error in it does not move anything."""
    rate = np.array([*diagonal[:-1], 1.0])
    v, free = least_squares(np.diag(diagonal), rate, rank)
    last = np.eye(len(diagonal))[-1]
    np.testing.assert_allclose(v, 1.0 - last, atol=ROUNDING)
    np.testing.assert_allclose(free, np.diag(last), atol=ROUNDING)


@given(st.lists(st.floats(-10.0, 10.0), min_size=1, max_size=8).map(np.array), st.floats(0.1, 5.0))
def test_a_saturated_motion_keeps_its_direction_within_the_limit(rates, limit):
    """And no more is taken than needed; rates at the limit are left alone."""
    fastest = np.max(np.abs(rates))
    share = 1.0 if fastest <= limit else limit / fastest
    assert saturation_share(rates, limit) == pytest.approx(share, rel=ROUNDING)
    assert saturation_share(np.array([limit, -limit]), limit) == 1.0


# The step.

X_CdO = frontal(0.09)
X_WP0 = pose_from_angles(np.array([0.112, -0.032, 0.301]), np.radians([-12.0, -10.0, 5.0]))
X_WO = pose_from_angles(np.array([0.2, -0.19, 0.0]), np.array([0.0, 0.0, 0.2]))
X_PO = pose_from_angles(np.array([0.02, 0.01, -0.05]), np.radians([180.0, 5.0, 10.0]))
DEPTHS = [DepthRule(), DepthRule("desired"), DepthRule("constant", 0.3)]


class ReadableServo:
    """One task of the law of `ServoController`, without plan and compensation, in NumPy."""

    def __init__(self, law, task, robot, X_PO):
        self.law, self.task, self.robot, self.X_PO = law, task, robot, X_PO
        self.began, self.toward = None, None

    def step(self, sight, X_WP, time):
        law, task = self.law, self.task
        s, L_now = task.features.evaluate(sight)
        L = {"current": L_now, "desired": task.L_desired}.get(
            task.interaction, (L_now + task.L_desired) / 2.0
        )
        e = s - task.final
        gain = law.gain(e)
        X_PC, sign = self.robot.X_PC, 1.0
        if self.X_PO is not None:
            X_CO = RigidTransform(np.column_stack([sight.R_CO, sight.p_CO]))
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


def scene(seed, name):
    """A servo of one task, its readable form, and what the camera sees from a pose."""
    rng = np.random.default_rng(seed)
    robot = load_robot(["acrobot_small", "caroca"][seed % 2])
    cables = robot.cable_set() if seed % 3 else robot.cable_set().without_pulleys()
    law = ServoLaw(
        AdaptiveGain(2.0, 2.0 - rng.choice([0.0, 1.5]), 30.0), sigma=rng.choice([None, 4.0]),
        yaw=YawTask(0.3, 0.7) if rng.uniform() < 0.5 else None,
        frame=rng.choice(["platform", "base"]),
    )  # fmt: skip
    in_world, planar = seed % 4 == 3, seed % 5 == 4 and law.frame == "platform"
    X_PC = robot.camera_mount("onboard").pose.transform() if not in_world else RigidTransform()
    motions = (2, 3, 4) if planar else (0, 1, 2, 3, 4, 5)
    believed = BelievedRobot(cables, X_PC, X_WP0, motions, rng.choice([0.02, 10.0]))

    def see(X_WP):
        X_CO = (X_WP @ X_PC).inverse() @ X_WO
        if in_world:  # in front of a camera somewhere
            X_CO = pose_from_angles([0.01, 0.02, 0.4], [3.0, 0.1, 0.0]) @ X_WP @ X_PO
        return seen(name, X_CO)

    interaction = ["current", "desired", "mean"][rng.integers(3)]
    task = make_task(MAKERS[name](X_CdO, DEPTHS[seed % 3]), seen(name, X_CdO), interaction)
    on_platform = X_PO if in_world else None
    servo = ServoController(law, [task], believed, PERIOD, on_platform)
    return servo, ReadableServo(law, task, believed, on_platform), see, rng


@pytest.mark.parametrize("name", PACKED)
def test_the_kernel_is_the_law_and_leaves_what_it_was_given(name):
    for seed in range(12):
        servo, readable, see, rng = scene(seed, name)
        memory = servo.fresh_memory()
        for k in range(4):
            p = X_WP0.translation() + rng.uniform(-0.02, 0.02, 3)
            X_WP = pose_from_angles(p, rng.uniform(-0.2, 0.2, 3))
            sight, R, time = see(X_WP), X_WP.rotation().matrix(), 1.0 + k * PERIOD
            before, row = memory.copy(), packed_sighting(sight)
            command, after = servo.step(memory, sight, R, p, time)
            np.testing.assert_array_equal(memory, before)
            np.testing.assert_array_equal(packed_sighting(sight), row)
            memory, expected = after, readable.step(sight, X_WP, time)
            numbers = command.cable_velocities, command.V_P, command.error, command.gain
            for number, value in zip(numbers, expected, strict=True):
                atol = KERNEL * max(1.0, np.max(np.abs(value)))
                np.testing.assert_allclose(number, value, rtol=0.0, atol=atol, err_msg=str(seed))


class InPython(ObjectPoseFeatures):
    """Features of which there is no kernel, as a user may write them."""

    def packed(self):
        return None


def test_features_plans_and_compensation_in_python_meet_the_same_law():
    """Ways past the compiled features; at the first step, before anything moves, all agree."""
    sight, desired = seen("pbvs", X_WP0 @ X_CdO.inverse()), seen("pbvs", X_CdO)
    believed = BelievedRobot(SMALL.cable_set(), RigidTransform([0.0, 0.01, 0.0]), X_WP0)
    law = ServoLaw(AdaptiveGain(2.0, 0.3, 30.0), 4.0)
    plain = make_task(ObjectPoseFeatures(X_CdO), desired)
    over = replace(plain, plan=FeaturePlan(plain.final, duration=1e-9))
    moving = replace(law, compensation=MotionFilter("difference", 2.0, PERIOD))
    servos = [
        ServoController(a_law, [task], believed, PERIOD)
        for a_law, task in (
            (law, plain), (law, make_task(InPython(X_CdO), desired)), (moving, plain), (law, over)
        )
    ]  # fmt: skip
    assert [servo.sees_packed for servo in servos] == [True, False, False, False]
    R, p = X_WP0.rotation().matrix(), X_WP0.translation()
    first, *others = (s.step(s.fresh_memory(), sight, R, p, 0.0)[0] for s in servos[:3])
    for other in others:
        np.testing.assert_allclose(other.V_P, first.V_P, rtol=0.0, atol=KERNEL)
        velocities = other.cable_velocities, first.cable_velocities
        np.testing.assert_allclose(*velocities, rtol=0.0, atol=KERNEL)


# The partitioned law.

FAR = frontal(0.3)
EDGES = np.array([-0.4, 0.4, -0.3, 0.3])
FIELD = EdgeField(0.7, 0.1, EDGES)


def partitioned(partition):
    believed = BelievedRobot(
        SMALL.cable_set().without_pulleys(), RigidTransform(), RigidTransform(), cable_speed=1e6
    )
    task = make_task(MAKERS["partitioned"](FAR), seen("partitioned", FAR))
    law = ServoLaw(AdaptiveGain(1.0, 1.0, 0.0), None, partition=partition)
    return ServoController(law, [task], believed, PERIOD)


starts = st.builds(
    lambda x, y, z, a, b, c: pose_from_angles(
        np.array([x * z, y * z, z]), np.array([np.pi + a, b, np.pi + c])
    ),
    st.floats(-0.15, 0.15), st.floats(-0.1, 0.1), st.floats(0.25, 0.7), st.floats(-0.4, 0.4),
    st.floats(-0.4, 0.4), st.floats(-1.5, 1.5),
)  # fmt: skip


@settings(max_examples=25)
@given(X_CO=starts, with_field=st.booleans(), goal=st.sampled_from(GOALS))
def test_the_partitioned_twist_is_the_law(X_CO, with_field, goal):
    """As published, v_xy = L_xy^+ (-lambda e + F - L_z v_z); for goals that turn L_xy^+ (-lambda e'
    + F). By NumPy's pseudo-inverse."""
    features, sight = MAKERS["partitioned"](FAR), seen("partitioned", X_CO)
    servo = partitioned(AxisPartition(0.5, FIELD if with_field else None, goal))
    command, _ = servo.step(servo.fresh_memory(), sight, np.eye(3), np.zeros(3), 0.0)
    s, L = features.evaluate(sight)
    e = s - features.evaluate(seen("partitioned", FAR))[0]
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
    np.testing.assert_allclose(command.V_P, expected, rtol=0.0, atol=KERNEL * scale)
    np.testing.assert_allclose(command.error, e, rtol=0.0, atol=KERNEL)


def test_the_field_is_the_slope_of_its_potential():
    """U = eta rho_0^4 (1 / rho - 1 / rho_0)^2 / 2 by central differences; nothing beyond rho_0."""
    law, rho_0 = partitioned(AxisPartition(1.0, FIELD))._law, FIELD.distance
    for rho in (0.055, 0.07, 0.09):
        up, down = (
            0.5 * FIELD.gain * rho_0**4 * (1.0 / r - 1.0 / rho_0) ** 2
            for r in (rho + STEP, rho - STEP)
        )
        slope = (up - down) / (2.0 * STEP)
        assert edge_push(law, EDGES[0] + rho, *EDGES[:2]) == pytest.approx(-slope, rel=1e-6)
        assert edge_push(law, EDGES[1] - rho, *EDGES[:2]) == pytest.approx(slope, rel=1e-6)
    assert edge_push(law, 0.0, *EDGES[:2]) == 0.0
    assert edge_push(law, EDGES[0], *EDGES[:2]) == pytest.approx(4.0 * FIELD.gain * rho_0)
