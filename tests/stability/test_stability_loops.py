"""Closed loops of the criterion's own equation: against plain NumPy, closed forms, refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform, RollPitchYaw

from cdpr_drake.arrays import Array
from cdpr_drake.errors import StabilityError
from cdpr_drake.geometry.poses import exponential, pose_row, rotation_from_vector, rotation_vector
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.stability.closed_loop_kernel import (
    CONVERGED,
    LEFT_BOX,
    STEP,
    TIMEOUT,
    closed_loops,
)
from cdpr_drake.stability.criterion import ModelAtPose
from cdpr_drake.stability.desired_view import FixedError, FixedObject
from cdpr_drake.stability.perturbation_bounds import BASELINE, PerturbationBounds
from cdpr_drake.stability.perturbation_samples_kernel import draw_perturbations
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.verdict import VerdictOptions, judge_stability, worst_perturbations
from tests.stability.stability_cases import random_poses
from tests.stability.stability_reference import reference_interaction

EVERYWHERE = (np.full(3, -10.0), np.full(3, 10.0))

ROUNDING = 1e-9
"""Of quotients at the start, through an inverse of condition up to about 1e3."""

TILT = 5e-3
"""The midpoint's axes instead of the exponential map, over a whole way, relative to the start."""


def spatial_loop_case() -> StabilityCase:
    robot = load_robot("acrobot_large")
    X_PC = RigidTransform(RollPitchYaw(np.pi, 0.1, -0.2), [-0.06, 0.01, 0.02])
    goal = RigidTransform(RollPitchYaw(0.05, -0.1, 0.1), [0.0, 0.05, 0.4])
    X_CdO = RigidTransform(RollPitchYaw(0.2, 0.1, 0.3), [0.02, -0.03, 0.4])
    return StabilityCase(
        robot.cable_set().without_pulleys(), "pbvs", X_PC=X_PC,
        target=FixedObject(goal @ X_PC @ X_CdO, X_CdO), lever="object",
    )  # fmt: skip


def planar_loop_case() -> StabilityCase:
    cables = load_robot("planar").cable_set().without_pulleys()
    return StabilityCase(
        cables, planar=True, lever="object", target=FixedObject(RigidTransform(), RigidTransform())
    )


def turned_camera(case: StabilityCase, pose: Array, turn: float) -> tuple[int, float]:
    d = np.zeros((1, 1, 18 + 6 * case.m))
    d[0, 0, 8] = turn
    found = closed_loops(case, PerturbationBounds(d_theta_pc=abs(turn)), pose, d, EVERYWHERE)
    return int(found.ends[0, 0]), float(found.falls[0, 0])


def followed(case: StabilityCase, pose: Array, d: Array, steps: int) -> Array:
    """|e| over |e| at the start after some steps, and -e' de/dt / |e|^2 at the start."""
    assert isinstance(case.target, FixedObject)
    X_WO, X_CdO, m = case.target.X_WO, case.target.X_CdO, case.m
    X = RigidTransform(Quaternion(pose[:4] / np.linalg.norm(pose[:4])), pose[4:])
    wrong = replace(
        case.cables,
        p_WA=case.cables.p_WA + d[18 : 18 + 3 * m].reshape(m, 3).T,
        p_PB=case.cables.p_PB + d[18 + 3 * m :].reshape(m, 3).T,
    )
    X_PC_hat = RigidTransform(
        case.X_PC.rotation() @ rotation_from_vector(d[6:9]), case.X_PC.translation() + d[9:12]
    )
    sizes, quotient = [], np.nan
    for step in range(steps + 1):
        X_CO = (X @ case.X_PC).inverse() @ X_WO
        theta_u = rotation_vector(X_CdO.rotation() @ X_CO.rotation().inverse())
        e = np.concatenate([theta_u, X_CO.translation() - X_CdO.translation()])
        L = reference_interaction(case, theta_u, e[3:], X_CO.translation(), np.eye(3))
        X_hat = RigidTransform(X.rotation() @ rotation_from_vector(d[:3]), X.translation() + d[3:6])
        J = ModelAtPose(X, case.cables, case.X_PC, L).camera_jacobian()
        J_hat = ModelAtPose(X_hat, wrong, X_PC_hat, L).camera_jacobian()
        V = -np.linalg.pinv(J) @ J_hat @ np.linalg.solve(L, e)
        sizes.append(np.linalg.norm(e))
        if step == 0:
            quotient = -(e @ L @ V) / (e @ e)
        X = X @ case.X_PC @ exponential(STEP * V) @ case.X_PC.inverse()
    return np.array([sizes[-1] / sizes[0], quotient])


def test_a_loop_is_that_of_plain_numpy() -> None:
    case, poses = spatial_loop_case(), random_poses(3)
    bounds = BASELINE.scaled(2.0)
    d = np.array([draw_perturbations(pose, bounds, case.m, 2, 5) for pose in poses])
    found = closed_loops(case, bounds, poses, d, EVERYWHERE, threads=1)
    for n, pose in enumerate(poses):
        for k in range(2):
            share, quotient = followed(case, pose, d[n, k], 300)
            assert found.falls[n, k] == pytest.approx(quotient, abs=ROUNDING)
            assert (found.ends[n, k] == CONVERGED) == (share < 1e-3 + TILT)


def test_a_perfect_model_falls_at_unit_rate() -> None:
    for case in (spatial_loop_case(), planar_loop_case()):
        poses = random_poses(4, case.planar)
        nothing = np.zeros((4, 1, 18 + 6 * case.m))
        found = closed_loops(case, PerturbationBounds(), poses, nothing, EVERYWHERE)
        assert np.all(found.ends == CONVERGED)
        assert found.falls == pytest.approx(np.ones((4, 1)), abs=ROUNDING)
        assert not np.any(found.rises)


@pytest.mark.parametrize("degrees", [30.0, 80.0, 100.0, 170.0])
def test_a_camera_turned_about_its_axis_has_the_closed_form(degrees: float) -> None:
    """Without a turn to make, the error's rate is cos G: it converges below 90 deg and no more."""
    pose = np.array([[1.0, 0, 0, 0, 0.1, -0.2, 0]])
    end, fall = turned_camera(planar_loop_case(), pose, np.radians(degrees))
    assert fall == pytest.approx(np.cos(np.radians(degrees)), abs=ROUNDING)
    assert (end == CONVERGED) == (degrees < 90.0)


def test_no_loop_rises_at_the_start_where_the_servo_is_certified() -> None:
    case, poses = spatial_loop_case(), random_poses(6)
    options = VerdictOptions(threads=1)
    certified = judge_stability(case, BASELINE, poses, "certified", options)
    assert np.any(certified.stable)
    _, worst = worst_perturbations(case, BASELINE, poses, options)
    found = closed_loops(case, BASELINE, poses, worst[:, None], EVERYWHERE)
    assert np.all(found.falls[certified.stable, 0] >= certified.margin[certified.stable])


def test_a_loop_that_starts_at_its_goal_is_there() -> None:
    """A thousandth of an error that is rounding is never reached."""
    case, rounding = spatial_loop_case(), 1e-16
    assert isinstance(case.target, FixedObject)
    X_WP = case.target.X_WO @ case.target.X_CdO.inverse() @ case.X_PC.inverse()
    pose = pose_row(X_WP) + rounding
    d = draw_perturbations(pose, BASELINE, case.m, 3, 5)
    found = closed_loops(case, BASELINE, pose[None], d[None], EVERYWHERE)
    assert np.all(found.ends == CONVERGED)
    assert np.all(found.falls == 1.0)


def test_where_it_rises_is_told() -> None:
    pose = np.array([[1.0, 0, 0, 0, 0.1, -0.2, 0]])
    d = np.zeros((1, 1, 18 + 6 * planar_loop_case().m))
    d[0, 0, 8] = np.radians(100.0)
    bounds = PerturbationBounds(d_theta_pc=2.0)
    found = closed_loops(planar_loop_case(), bounds, pose, d, EVERYWHERE)
    assert found.rises[0, 0]
    assert found.rise_poses[0, 0] == pytest.approx(pose[0])
    near = (np.array([-0.15, -0.25, -1.0]), np.array([0.15, 0.25, 1.0]))
    assert closed_loops(planar_loop_case(), bounds, pose, d, near).ends[0, 0] == LEFT_BOX
    d[0, 0, 8] = np.radians(90.0)
    assert closed_loops(planar_loop_case(), bounds, pose, d, EVERYWHERE).ends[0, 0] == TIMEOUT


def test_poses_are_rows_of_their_own() -> None:
    case, poses = spatial_loop_case(), random_poses(5)
    d = np.array([draw_perturbations(pose, BASELINE, case.m, 1, 5) for pose in poses])
    whole = closed_loops(case, BASELINE, poses, d, EVERYWHERE, threads=2)
    part = closed_loops(case, BASELINE, poses[3:], d[3:], EVERYWHERE, threads=1)
    np.testing.assert_array_equal(whole.falls[3:], part.falls)
    np.testing.assert_array_equal(whole.ends[3:], part.ends)


def test_what_no_loop_is_for_is_refused() -> None:
    poses, d = random_poses(1), np.zeros((1, 1, 66))
    case = spatial_loop_case()
    for other in (replace(case, scheme="ibvs"), replace(case, target=FixedError())):
        with pytest.raises(StabilityError, match="accepted: pbvs to FixedObject"):
            closed_loops(other, BASELINE, poses, d, EVERYWHERE)
    with pytest.raises(StabilityError, match="lever error"):
        closed_loops(replace(case, lever="error"), BASELINE, poses, d, EVERYWHERE)
