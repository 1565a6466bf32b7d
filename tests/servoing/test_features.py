"""Features and their interaction matrices: finite differences of a moving camera, closed forms,
ranks, and their compiled forms."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform

from cdpr_drake.errors import VisualFeatureError
from cdpr_drake.geometry.poses import exponential, pose_from_angles, rotation_from_vector
from cdpr_drake.servoing.combined_features import PartitionedFeatures
from cdpr_drake.servoing.interaction_matrix_kernel import point_into
from cdpr_drake.servoing.packed_features_kernel import CENTER, MARKS
from cdpr_drake.servoing.point_features import check_points, interaction_rank
from cdpr_drake.servoing.pose_features import (
    pose_feature_error,
    pose_interaction,
    theta_u_interaction,
)
from cdpr_drake.servoing.visual_features import DepthRule, columns, packed_sighting
from tests.servoing.servo_cases import MAKERS, RING, frontal, points, seen

ROUND_OFF = 1e-12
STEP = 1e-6
DIFFERENCE = 2e-7
"""Central differences: round-off 1e-16 / 1e-6 times coordinates up to 10, and the third derivative
times 1e-12, which grows with 1 / depth."""
POSE_DIFFERENCE = 1e-8  # third derivatives of poses grow to 1e3 where theta nears pi or above
DETERMINANT = 1e-10  # relative; a 3 x 3 determinant of entries up to 3

X_CdO = frontal(0.3)
SCHEMES = {name: make(X_CdO) for name, make in MAKERS.items()}

coordinate = st.floats(-1.0, 1.0)
vector = st.tuples(*[coordinate] * 3).map(np.array)
twists = st.tuples(*[coordinate] * 6).map(np.array)
unit = vector.filter(lambda v: np.linalg.norm(v) > 0.1).map(lambda v: v / np.linalg.norm(v))
# Short of pi, where the rotation vector jumps to the other side.
turns = st.builds(lambda u, theta: u * theta, unit, st.floats(0.0, 3.0) | st.floats(0.0, 1e-5))
free = st.builds(lambda r, p: RigidTransform(rotation_from_vector(r), p), turns, vector)
visible = st.builds(
    lambda tilt_x, tilt_y, turn, x, y, z: RigidTransform(
        rotation_from_vector(np.array([tilt_x, tilt_y, 0.0]))
        @ pose_from_angles(np.zeros(3), np.array([np.pi, 0.0, turn])).rotation(),
        z * np.array([x, y, 1.0]),
    ),
    st.floats(-0.9, 0.9), st.floats(-0.9, 0.9), st.floats(np.pi - 1.0, np.pi + 1.0),
    st.floats(-0.4, 0.4), st.floats(-0.4, 0.4), st.floats(0.2, 2.0),
)  # fmt: skip


def rate(function, X_CO, V_C):
    """How a function of X_CO changes as the camera moves by exp(V t), the object at rest."""
    ahead, back = (function(exponential(-V_C * time) @ X_CO) for time in (STEP, -STEP))
    return (ahead - back) / (2.0 * STEP)


# Poses.


@settings(max_examples=60)
@given(free, turns, vector, twists)
def test_pose_interaction_is_the_derivative_of_rotation_vector_and_offset(
    X_CO, theta_u, offset, V_C
):
    """Block triangular: translations do not turn the object in the image, and shift it one to one;
    turning about the axis changes only the angle."""
    R = rotation_from_vector(theta_u) @ X_CO.rotation()
    X_CdO = RigidTransform(R, X_CO.translation() + offset)
    error = pose_feature_error(X_CO, X_CdO)
    np.testing.assert_allclose(error, [*theta_u, *-offset], atol=ROUND_OFF)
    np.testing.assert_allclose(pose_feature_error(X_CO, X_CO), np.zeros(6), atol=ROUND_OFF)
    L = pose_interaction(X_CO, X_CdO)
    expected = rate(lambda X: pose_feature_error(X, X_CdO), X_CO, V_C)
    np.testing.assert_allclose(L @ V_C, expected, rtol=0.0, atol=POSE_DIFFERENCE)
    np.testing.assert_array_equal(L[:3, 3:], np.zeros((3, 3)))
    np.testing.assert_array_equal(L[3:, 3:], -np.eye(3))
    turning = theta_u_interaction(theta_u)
    np.testing.assert_allclose(turning @ theta_u, theta_u, atol=ROUND_OFF)
    only_turn = rate(
        lambda X: pose_feature_error(X, RigidTransform(rotation_from_vector(theta_u), np.zeros(3))),
        RigidTransform(), np.concatenate([V_C[:3], np.zeros(3)]),
    )  # fmt: skip
    np.testing.assert_allclose(turning @ V_C[:3], only_turn[:3], rtol=0.0, atol=POSE_DIFFERENCE)


@given(unit, st.floats(0.0, 1e-5) | st.floats(1e-5, 6.2))
def test_the_determinant_has_a_closed_form(axis, theta):
    """det(L) = 1 / sinc^2(theta / 2), so L is regular within a full turn."""
    determinant = np.linalg.det(theta_u_interaction(axis * theta))
    expected = 1.0 / np.sinc(theta / 2.0 / np.pi) ** 2  # NumPy's sinc has the pi inside
    assert determinant == pytest.approx(expected, rel=DETERMINANT)
    np.testing.assert_array_equal(theta_u_interaction(np.zeros(3)), np.eye(3))


# All schemes.


@pytest.mark.parametrize("name", SCHEMES)
@settings(max_examples=25)
@given(X_CO=visible, V_C=twists)
def test_the_interaction_matrix_is_the_derivative_of_the_features(name, X_CO, V_C):
    features = SCHEMES[name]
    s, L = features.evaluate(seen(name, X_CO))
    assert s.shape == (len(features.names),)
    assert len(features.units()) == len(features.names)
    expected = rate(lambda X: features.evaluate(seen(name, X))[0], X_CO, V_C)
    np.testing.assert_allclose(L @ V_C, expected, rtol=0.0, atol=DIFFERENCE)


@pytest.mark.parametrize("name", SCHEMES)
def test_at_the_desired_pose_the_promised_motions_are_controlled(name):
    s, L = SCHEMES[name].evaluate(seen(name, X_CdO))
    five = name in ("2.5d, five", "pbvs, five", "without the first", "circles")
    assert interaction_rank(L) == SCHEMES[name].rank == (5 if five else 6)
    if name == "pbvs-line":
        np.testing.assert_allclose(s, np.zeros(6), atol=ROUND_OFF)


def test_what_is_seen_is_packed_as_kernels_read_it():
    sight = seen("ibvs", X_CdO)
    row = packed_sighting(sight)
    np.testing.assert_array_equal(row[:CENTER], columns(X_CdO))
    np.testing.assert_array_equal(row[CENTER:MARKS], sight.center)
    np.testing.assert_array_equal(row[MARKS:], np.ravel(sight.marks))


@pytest.mark.parametrize("name", ["ibvs", "2.5d", "circles"])
def test_the_depth_comes_from_where_the_rule_says(name):
    """Rows of translation go with 1 / depth, those of rotation do not."""
    far = RigidTransform(X_CdO.rotation(), 2.0 * X_CdO.translation())
    measured, desired, constant = (
        MAKERS[name](X_CdO, rule).evaluate(seen(name, far))[1][:2]
        for rule in (DepthRule("pose"), DepthRule("desired"), DepthRule("constant", 0.15))
    )
    for matrix, factor in ((desired, 2.0), (constant, 4.0)):
        np.testing.assert_allclose(matrix[:, 3:], factor * measured[:, 3:], atol=ROUND_OFF)
        np.testing.assert_allclose(matrix[:, :3], measured[:, :3], atol=ROUND_OFF)


# Polygons, circles and points.


@pytest.mark.parametrize("name", ["partitioned", "partitioned, three"])
@settings(max_examples=30)
@given(turn=st.floats(-3.1, 3.1), depth=st.floats(0.1, 1.0))
def test_frontal_points_show_axis_and_depth_in_closed_form(name, turn, depth):
    """alpha turns by less what the camera turns, sigma is edge / Z; rates of both, by hand."""
    turned = pose_from_angles(np.zeros(3), np.array([0.0, 0.0, turn]))
    X_CO = turned.inverse() @ RigidTransform(X_CdO.rotation(), [0.0, 0.0, depth])
    s, L = SCHEMES[name].evaluate(seen(name, X_CO))
    np.testing.assert_allclose(s[-2:], [-turn, np.log(0.3 / depth)], rtol=0.0, atol=1e-9)
    if name == "partitioned":  # a triangle's size depends on tilts to first order as well
        expected = [[0.0, 0.0, -1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, 0.0, 1.0 / depth]]
        np.testing.assert_allclose(L[-2:], expected, atol=1e-9)
    np.testing.assert_allclose(L[-2:, [2, 5]], [[-1.0, 0.0], [0.0, 1.0 / depth]], atol=1e-9)


def test_a_polygon_seen_edge_on_says_nothing_of_the_depth():
    X_CO = pose_from_angles(np.array([0.0, 0.0, 0.3]), np.radians([90.0, 0.0, 0.0]))
    s, L = SCHEMES["partitioned"].evaluate(seen("partitioned", X_CO))
    assert np.all(np.isfinite(s))
    np.testing.assert_array_equal(L[-1], np.zeros(6))


def test_frontal_circles_do_not_show_the_rotation_about_the_optical_axis():
    """The frontal case has a closed form; servoing thesis (1.58) stands for it."""
    _, L = SCHEMES["circles"].evaluate(seen("circles", X_CdO))
    for k, radius in enumerate(RING.radii):
        n, expected = radius**2 / (4.0 * 0.3**2), np.zeros((5, 6))
        expected[0, [1, 3]] = -(1.0 + 4.0 * n), -1.0 / 0.3
        expected[1, [0, 4]] = 1.0 + 4.0 * n, -1.0 / 0.3
        expected[[2, 4], 5] = 2.0 * n / 0.3
        np.testing.assert_allclose(L[5 * k : 5 * k + 5], expected, atol=ROUND_OFF)


@settings(max_examples=40)
@given(visible)
def test_ellipses_are_the_area_moments_of_projected_circles(X_CO):
    """Green's theorem on polygons with 4000 corners, whose moments fall short by (pi / 4000)^2."""
    angle = np.linspace(0.0, 2.0 * np.pi, 4001)
    for radius, ellipse in zip(RING.radii, RING.ideal_marks(X_CO), strict=True):
        p = X_CO @ (radius * np.array([np.cos(angle), np.sin(angle), np.zeros(4001)]))
        # Far from the origin round-off would eat the moments: measured from near the centre.
        x, y = p[0] / p[2] - ellipse[0], p[1] / p[2] - ellipse[1]
        x0, x1, y0, y1 = x[:-1], x[1:], y[:-1], y[1:]
        cross = x0 * y1 - x1 * y0
        area = np.sum(cross) / 2.0
        cx, cy = (np.sum((a + b) * cross) / 6.0 / area for a, b in ((x0, x1), (y0, y1)))
        xx, yy = (
            np.sum((a**2 + a * b + b**2) * cross) / 12.0 / area for a, b in ((x0, x1), (y0, y1))
        )
        pairs = x0 * y1 + 2.0 * x0 * y0 + 2.0 * x1 * y1 + x1 * y0
        xy = np.sum(pairs * cross) / 24.0 / area
        size = np.sqrt(xx + yy)
        np.testing.assert_allclose([cx, cy], 0.0, atol=1e-5 * size)
        expected = [xx - cx * cx, xy - cx * cy, yy - cy * cy]
        np.testing.assert_allclose(ellipse[2:], expected, rtol=0.0, atol=1e-5 * size**2)


@settings(max_examples=50)
@given(visible, st.integers(3, 9), st.integers(0, 2**32 - 1))
def test_points_on_a_line_control_five_motions_at_most(X_CO, count, seed):
    random = np.random.default_rng(seed)
    along = np.linspace(-0.1, 0.1, count) + 1e-3 * random.standard_normal(count)
    direction = np.array([np.cos(seed), np.sin(seed), 0.0])
    line = direction[:, np.newaxis] * along + 0.02 * random.standard_normal((3, 1))
    L = np.empty((2 * count, 6))
    for k, (x, y, z) in enumerate((X_CO @ line).T):
        point_into(x / z, y / z, z, L, 2 * k)
    assert interaction_rank(L) <= 5
    with pytest.raises(VisualFeatureError, match="on one line, whose interaction matrix is singul"):
        check_points(line)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: PartitionedFeatures(points(X_CdO, chosen=(0, 1, 3)), (1, 2)),
            r"segment: found \[1, 2\].*points \[0, 1, 3\]",
        ),
        (lambda: points(X_CdO, chosen=(0, 2)), "found 2 image points; accepted: at least 3"),
    ],
)
def test_refusal(call, message):
    with pytest.raises(VisualFeatureError, match=message):
        call()


def test_three_points_are_singular_on_the_cylinder_through_them():
    """Where the camera lies on the right circular cylinder through three points; the matrix of four
    points is regular there."""
    radius = 0.06 / np.sqrt(2.0)  # of the circle through the corners of the square
    X_CO = RigidTransform(X_CdO.rotation().inverse(), [radius, 0.0, 0.4]).inverse()
    three, four = (SCHEMES[name].evaluate(seen(name, X_CO))[1] for name in ("ibvs, three", "ibvs"))
    assert interaction_rank(three) == 5
    assert interaction_rank(four) == 6


@given(st.integers(0, 2**32 - 1), st.integers(1, 5))
def test_the_rank_does_not_depend_on_units(seed, rank):
    random = np.random.default_rng(seed)
    L = random.standard_normal((8, rank)) @ random.standard_normal((rank, 6))
    millimetres = L * np.array([1.0, 1.0, 1.0, 1e-3, 1e-3, 1e-3])
    assert interaction_rank(L) == interaction_rank(millimetres) == rank
