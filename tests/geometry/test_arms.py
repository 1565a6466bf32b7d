"""Arms that swivel about exit points: closed forms, finite differences, and what does not go."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix

import cdpr_drake as cdpr
from cdpr_drake import models
from cdpr_drake.analyses.workspaces.proven_sets import ProvenSets
from cdpr_drake.cables.curves import cable_curves
from cdpr_drake.cables.models import check_model
from cdpr_drake.calibration.station_kernel import LENGTH, U, cable_terms
from cdpr_drake.errors import CableGeometryError, CableModelError, RobotFileError, WorkspaceError
from cdpr_drake.geometry.cable_paths import cable_jacobian, cable_paths, motion_of
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.pulley_kernel import unit_vector_derivative
from cdpr_drake.planning.cable_derivatives_kernel import bend_gradient, exit_derivative
from tests.models.robots import content_of, robot_of

STEP = 1e-6
"""Of central differences [m, rad]: their error is its square, and rounding over it."""

CLOSE = 1e-7

A = np.array([[0.0, 3.0, 0.0, 3.0], [2.0, 2.0, 0.0, 0.0], [-0.1, -0.056, -0.034, -0.078]])
ARM = 0.1534
"""Anchors of a board [m], below the sled, and the arms between its middle and the belts [m]."""

TILTED = np.array([0.36, -0.48, 0.8])


def board(axis=(0.0, 0.0, 1.0)):
    return CableSet.make(A, np.zeros((3, 4)), 1e5, swivel_axis=axis, arm=ARM)


@pytest.mark.parametrize("place", [(0.5, 1.6), (0.6, 1.4), (1.5, 1.0), (2.7, 0.2)])
def test_arms_stay_level_and_only_the_belt_is_inclined(place):
    """As MaslowKinematics::compute has it: the distance across, less the arm, and the height."""
    paths = cable_paths(RigidTransform([*place, 0.0]), board())
    across = np.hypot(A[0] - place[0], A[1] - place[1])
    belts = np.hypot(across - ARM, A[2])
    np.testing.assert_allclose(paths.lengths, belts, rtol=1e-14)
    np.testing.assert_array_equal(paths.arcs, 0.0)
    ends = paths.p_WT + paths.free * paths.u_W
    np.testing.assert_allclose(ends, np.tile([[*place, 0.0]], (4, 1)).T, atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(paths.p_WT - A, axis=0), ARM)
    np.testing.assert_allclose(paths.p_WT[2], A[2])


def test_the_published_example():
    """tl at (0.5, 1.6) m: 497.08 mm."""
    lengths = cable_paths(RigidTransform([0.5, 1.6, 0.0]), board()).lengths
    assert 1e3 * lengths[0] == pytest.approx(497.08, abs=0.005)


def body():
    """Cables with arms about axes of any direction, to a body that turns."""
    rng = np.random.default_rng(3)
    p_WA, p_PB = rng.uniform(-2.0, 2.0, (3, 6)), rng.uniform(-0.2, 0.2, (3, 6))
    return CableSet.make(p_WA, p_PB, 1e5, swivel_axis=TILTED, arm=np.linspace(0.0, 0.3, 6))


X = RigidTransform(RotationMatrix.MakeXRotation(0.3), [0.1, 0.2, -0.3])


def moved(twist):
    w, v = np.asarray(twist[:3]), np.asarray(twist[3:])
    angle = float(np.linalg.norm(w))
    from pydrake.common.eigen_geometry import AngleAxis

    R = RotationMatrix(AngleAxis(angle, w / angle)) if angle else RotationMatrix()
    return RigidTransform(R @ X.rotation(), X.translation() + v)


def test_the_jacobian_is_the_derivative_of_the_lengths():
    cables = body()
    for k, twist in enumerate(np.eye(6)):
        ends = [cable_paths(moved(s * STEP * twist), cables).lengths for s in (1.0, -1.0)]
        slope = (ends[0] - ends[1]) / (2.0 * STEP)
        np.testing.assert_allclose(cable_jacobian(X, cables)[:, k], slope, atol=CLOSE)


def test_line_end_and_bend_move_as_differences_say():
    cables, v = body(), (0.3, -0.7, 0.2)
    for row in cables.packed():
        one = [CableSet.make(row[:3, None], row[3:6, None], 1.0, swivel_axis=TILTED, arm=-row[8])]
        out, end, bend = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
        unit_vector_derivative(motion_of(X), row, out)
        exit_derivative(motion_of(X), row, end)
        bend_gradient(motion_of(X), row, v, bend)
        for k, d in enumerate(STEP * np.eye(3)):
            poses = [RigidTransform(X.rotation(), X.translation() + s * d) for s in (1.0, -1.0)]
            paths = [cable_paths(pose, one[0]) for pose in poses]
            for found, name in ((out, "u_W"), (end, "p_WT")):
                ahead, behind = (getattr(path, name)[:, 0] for path in paths)
                np.testing.assert_allclose(found[:, k], (ahead - behind) / (2 * STEP), atol=CLOSE)
            values = [bend_gradient(motion_of(pose), row, v, np.empty(3)) for pose in poses]
            assert bend[k] == pytest.approx((values[0] - values[1]) / (2 * STEP), abs=1e-6)


def test_calibration_has_the_same_lengths():
    cables = body()
    numbers, vectors = np.empty((1, 6, 3)), np.empty((1, 6, 12))
    hessians = np.empty((1, 6, 3, 3))
    R, p = X.rotation().matrix()[None].copy(), X.translation()[None].copy()
    cable_terms(R, p, cables.packed(), numbers, vectors, hessians)
    paths = cable_paths(X, cables)
    np.testing.assert_allclose(numbers[0, :, LENGTH], paths.lengths, rtol=1e-14)
    np.testing.assert_allclose(vectors[0, :, U : U + 3].T, paths.u_W, atol=1e-14)
    for row, hessian in zip(cables.packed(), hessians[0], strict=True):
        out = np.empty((3, 3))
        unit_vector_derivative(motion_of(X), row, out)
        np.testing.assert_allclose(hessian, out, atol=1e-12)


def test_a_pose_within_the_arm_is_refused():
    with pytest.raises(CableGeometryError, match=r"within the length 0.1534 m of its arm"):
        cable_paths(RigidTransform([0.1, 1.95, 0.0]), board())


def test_an_arm_is_drawn_between_exit_point_and_belt():
    place = RigidTransform([0.5, 1.6, 0.0])
    lengths = cable_paths(place, board()).lengths
    curve = cable_curves(board(), "elastic", place, 0.99 * lengths)[0]
    np.testing.assert_allclose(curve[:, 0], A[:, 0])
    np.testing.assert_allclose(np.linalg.norm(curve[:, 1] - A[:, 0]), ARM)
    np.testing.assert_allclose(curve[:, -1], place.translation())


def test_what_does_not_go_with_arms_is_refused():
    with pytest.raises(CableModelError, match=r"arm of cable 1: found 0.1; accepted: 0 with pulle"):
        CableSet.make(A, np.zeros((3, 4)), 1e5, arm=0.1, pulley_radius=0.02)
    with pytest.raises(CableModelError, match="accepted: a finite number >= 0"):
        CableSet.make(A, np.zeros((3, 4)), 1e5, arm=-0.1)
    with pytest.raises(CableModelError, match=r"arm of cable 1: found 0.1534; accepted for"):
        check_model("catenary", board())
    content = content_of("maslow_4")
    content["pulley"]["radius"] = 0.02
    with pytest.raises(RobotFileError, match=r"pulley.arm: found 0.1534 with pulleys"):
        robot_of(content)
    with pytest.raises(WorkspaceError, match=r"certify: found maslow_4 with arms, pulley.arm 0.15"):
        ProvenSets.find("maslow_4", ["wrench-closure"])


def test_without_pulleys_there_are_no_arms():
    assert board().has_pulleys()
    plain = board().without_pulleys()
    assert not plain.has_pulleys()
    X_WP = RigidTransform([0.5, 1.6, 0.0])
    straight = np.linalg.norm(A.T - X_WP.translation(), axis=1)
    np.testing.assert_allclose(cable_paths(X_WP, plain).lengths, straight)


def test_tensions_of_a_sled_balance_across_the_board():
    """Of maslow_4 as it ships, whose board carries its weight and what belts pull down."""
    robot, X_WP = models.load_robot("maslow_4"), RigidTransform([0.8, 2.6, 0.0])
    found, paths = cdpr.solve_static(robot, X_WP), cable_paths(X_WP, robot.cable_set())
    np.testing.assert_allclose((paths.u_W @ found.tensions)[:2], 0.0, atol=1e-8)
    assert np.abs(paths.u_W[2]).max() > 0.01
