"""Every scheme's interaction matrix against finite differences of a moving camera, and its rank."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform

from cdpr_drake.errors import VisualFeatureError
from cdpr_drake.geometry.poses import exponential, pose_from_angles, rotation_from_vector
from cdpr_drake.servoing.combined_features import PartitionedFeatures, SwitchedFeatures
from cdpr_drake.servoing.point_features import check_points, interaction_rank, points_interaction
from cdpr_drake.servoing.visual_features import (
    CameraPoseFeatures,
    CircleFeatures,
    DepthRule,
    HybridFeatures,
    ObjectPoseFeatures,
    PointFeatures,
    WithoutFeature,
    sighting,
)
from cdpr_drake.vision.dots import DotTarget
from cdpr_drake.vision.rings import CircleTarget

STEP = 1e-6
DIFFERENCE = 2e-7
"""Central differences: round-off 1e-16 / 1e-6 times coordinates up to 10, and the third derivative
times 1e-12, which grows with 1 / depth."""

ROUND_OFF = 1e-12

SIZE = 0.1
DOTS, RING = DotTarget(SIZE), CircleTarget(SIZE)
X_CdO = pose_from_angles(np.array([0.0, 0.0, 0.3]), np.radians([180.0, 0.0, 180.0]))

POINTS = PointFeatures(DOTS.points, X_CdO)

SCHEMES = {
    "pbvs": (ObjectPoseFeatures(X_CdO), DOTS),
    "pbvs-line": (CameraPoseFeatures(X_CdO), DOTS),
    "2.5d": (HybridFeatures(X_CdO), DOTS),
    "ibvs": (POINTS, DOTS),
    "ibvs, three points": (PointFeatures(DOTS.points, X_CdO, chosen=(0, 1, 3)), DOTS),
    "circles": (CircleFeatures(RING.radii, X_CdO), RING),
    "pbvs, five": (WithoutFeature(ObjectPoseFeatures(X_CdO)), DOTS),
    "2.5d, five": (WithoutFeature(HybridFeatures(X_CdO)), DOTS),
    "partitioned": (PartitionedFeatures(POINTS), DOTS),
    "partitioned, three points": (
        PartitionedFeatures(PointFeatures(DOTS.points, X_CdO, chosen=(3, 0, 1)), (1, 3)),
        DOTS,
    ),
    "switching": (SwitchedFeatures(POINTS), DOTS),
    "switching, object": (SwitchedFeatures(POINTS, of_camera=False), DOTS),
}

coordinate = st.floats(-1.0, 1.0)
twists = st.tuples(*[coordinate] * 6).map(np.array)
poses = st.builds(
    lambda tilt_x, tilt_y, turn, x, y, z: RigidTransform(
        rotation_from_vector(np.array([tilt_x, tilt_y, 0.0]))
        @ pose_from_angles(np.zeros(3), np.array([np.pi, 0.0, turn])).rotation(),
        z * np.array([x, y, 1.0]),
    ),
    st.floats(-0.9, 0.9),
    st.floats(-0.9, 0.9),
    st.floats(np.pi - 1.0, np.pi + 1.0),
    st.floats(-0.4, 0.4),
    st.floats(-0.4, 0.4),
    st.floats(0.2, 2.0),
)


def seen(target, X_CO):
    return sighting(X_CO, target.ideal_marks(X_CO))


@pytest.mark.parametrize("name", SCHEMES)
@settings(max_examples=40)
@given(X_CO=poses, V_C=twists)
def test_the_interaction_matrix_is_the_derivative_of_the_features(name, X_CO, V_C):
    """The camera moves by exp(V t) in its own frame, the object is at rest."""
    features, target = SCHEMES[name]
    s, L = features.evaluate(seen(target, X_CO))
    ahead, back = (
        features.evaluate(seen(target, exponential(-V_C * time) @ X_CO))[0]
        for time in (STEP, -STEP)
    )
    assert s.shape == (len(features.names),)
    assert len(features.units()) == len(features.names)
    np.testing.assert_allclose(L @ V_C, (ahead - back) / (2.0 * STEP), rtol=0.0, atol=DIFFERENCE)


@pytest.mark.parametrize("name", SCHEMES)
def test_at_the_desired_pose_the_promised_motions_are_controlled(name):
    features, target = SCHEMES[name]
    s, L = features.evaluate(seen(target, X_CdO))
    assert interaction_rank(L) == features.rank
    assert features.rank == (5 if "five" in name or name == "circles" else 6)
    if name.startswith("pbvs-line"):
        np.testing.assert_allclose(s, np.zeros(6), atol=ROUND_OFF)


@pytest.mark.parametrize("name", ["partitioned", "partitioned, three points"])
@given(turn=st.floats(-3.1, 3.1), depth=st.floats(0.1, 1.0))
def test_frontal_points_show_axis_and_depth_in_closed_form(name, turn, depth):
    """alpha turns by less what the camera turns, sigma is edge / Z; rates of both, by hand."""
    features, _ = SCHEMES[name]
    turned = pose_from_angles(np.zeros(3), np.array([0.0, 0.0, turn]))
    X_CO = turned.inverse() @ RigidTransform(X_CdO.rotation(), [0.0, 0.0, depth])
    s, L = features.evaluate(seen(DOTS, X_CO))
    assert s[-2] == pytest.approx(-turn, abs=1e-9)
    assert s[-1] == pytest.approx(np.log(X_CdO.translation()[2] / depth), abs=1e-9)
    about, along = np.zeros(6), np.zeros(6)
    about[2], along[5] = -1.0, 1.0 / depth
    if name == "partitioned":  # a triangle's size depends on tilts to first order as well
        np.testing.assert_allclose(L[-2:], [about, along], atol=1e-9)
    np.testing.assert_allclose(L[-2:, [2, 5]], [[-1.0, 0.0], [0.0, 1.0 / depth]], atol=1e-9)


def test_a_polygon_seen_edge_on_says_nothing_of_the_depth():
    X_CO = pose_from_angles(np.array([0.0, 0.0, 0.3]), np.radians([90.0, 0.0, 0.0]))
    s, L = SCHEMES["partitioned"][0].evaluate(seen(DOTS, X_CO))
    assert np.all(np.isfinite(s))
    np.testing.assert_array_equal(L[-1], np.zeros(6))


def test_a_segment_needs_two_chosen_points():
    with pytest.raises(VisualFeatureError, match=r"segment: found \[1, 2\].*points \[0, 1, 3\]"):
        PartitionedFeatures(PointFeatures(DOTS.points, X_CdO, chosen=(0, 1, 3)), (1, 2))


def test_frontal_circles_do_not_show_the_rotation_about_the_optical_axis():
    """The frontal case has a closed form; servoing thesis (1.58) stands for it."""
    _, L = SCHEMES["circles"][0].evaluate(seen(RING, X_CdO))
    Z = X_CdO.translation()[2]
    for k, radius in enumerate(RING.radii):
        n = radius**2 / (4.0 * Z**2)
        expected = np.zeros((5, 6))
        expected[0, [1, 3]] = -(1.0 + 4.0 * n), -1.0 / Z
        expected[1, [0, 4]] = 1.0 + 4.0 * n, -1.0 / Z
        expected[[2, 4], 5] = 2.0 * n / Z
        np.testing.assert_allclose(L[5 * k : 5 * k + 5], expected, atol=ROUND_OFF)


@given(poses)
def test_ellipses_are_the_area_moments_of_projected_circles(X_CO):
    """Green's theorem on polygons with 4000 corners, whose moments fall short by (pi / 4000)^2."""
    angle = np.linspace(0.0, 2.0 * np.pi, 4001)
    found = RING.ideal_marks(X_CO)
    for radius, ellipse in zip(RING.radii, found, strict=True):
        p = X_CO @ (radius * np.array([np.cos(angle), np.sin(angle), np.zeros(4001)]))
        # Far from the origin round-off would eat the moments: measured from near the centre.
        x, y = p[0] / p[2] - ellipse[0], p[1] / p[2] - ellipse[1]
        cross = x[:-1] * y[1:] - x[1:] * y[:-1]
        area = np.sum(cross) / 2.0
        cx = np.sum((x[:-1] + x[1:]) * cross) / 6.0 / area
        cy = np.sum((y[:-1] + y[1:]) * cross) / 6.0 / area
        xx = np.sum((x[:-1] ** 2 + x[:-1] * x[1:] + x[1:] ** 2) * cross) / 12.0 / area
        yy = np.sum((y[:-1] ** 2 + y[:-1] * y[1:] + y[1:] ** 2) * cross) / 12.0 / area
        pairs = x[:-1] * y[1:] + 2.0 * x[:-1] * y[:-1] + 2.0 * x[1:] * y[1:] + x[1:] * y[:-1]
        xy = np.sum(pairs * cross) / 24.0 / area
        size = np.sqrt(xx + yy)
        np.testing.assert_allclose([cx, cy], 0.0, atol=1e-5 * size)
        expected = [xx - cx * cx, xy - cx * cy, yy - cy * cy]
        np.testing.assert_allclose(ellipse[2:], expected, rtol=0.0, atol=1e-5 * size**2)


@pytest.mark.parametrize("name", ["ibvs", "2.5d", "circles"])
def test_the_depth_comes_from_where_the_rule_says(name):
    """Rows of translation go with 1 / depth, those of rotation do not."""
    target = RING if name == "circles" else DOTS

    def matrix(rule, X_CO):
        features = {
            "ibvs": lambda: PointFeatures(DOTS.points, X_CdO, rule),
            "2.5d": lambda: HybridFeatures(X_CdO, rule),
            "circles": lambda: CircleFeatures(RING.radii, X_CdO, rule),
        }[name]()
        return features.evaluate(seen(target, X_CO))[1][:2]

    far = RigidTransform(X_CdO.rotation(), 2.0 * X_CdO.translation())
    measured, desired = matrix(DepthRule("pose"), far), matrix(DepthRule("desired"), far)
    constant = matrix(DepthRule("constant", 0.15), far)
    np.testing.assert_allclose(desired[:, 3:], 2.0 * measured[:, 3:], atol=ROUND_OFF)
    np.testing.assert_allclose(constant[:, 3:], 4.0 * measured[:, 3:], atol=ROUND_OFF)
    for other in (desired, constant):
        np.testing.assert_allclose(other[:, :3], measured[:, :3], atol=ROUND_OFF)


@given(poses, st.integers(3, 9), st.integers(0, 2**32 - 1))
def test_points_on_a_line_control_five_motions_at_most(X_CO, count, seed):
    random = np.random.default_rng(seed)
    along = np.linspace(-SIZE, SIZE, count) + 0.01 * SIZE * random.standard_normal(count)
    direction = np.array([np.cos(seed), np.sin(seed), 0.0])
    line = direction[:, np.newaxis] * along + 0.02 * random.standard_normal((3, 1))
    p_CK = X_CO @ line
    L = points_interaction(p_CK[:2] / p_CK[2], p_CK[2])
    assert interaction_rank(L) <= 5
    with pytest.raises(VisualFeatureError, match="on one line, whose interaction matrix is singul"):
        check_points(line)


def test_two_points_are_too_few():
    with pytest.raises(VisualFeatureError, match="found 2 image points; accepted: at least 3"):
        PointFeatures(DOTS.points, X_CdO, chosen=(0, 2))


def test_three_points_are_singular_on_the_cylinder_through_them():
    """Where the camera lies on the right circular cylinder through three points; the matrix of four
    points is regular there."""
    radius = SIZE / np.sqrt(2.0)  # of the circle through the corners of the square
    p_OC = np.array([radius, 0.0, 0.4])
    X_OC = RigidTransform(X_CdO.rotation().inverse(), p_OC)
    X_CO = X_OC.inverse()
    three = SCHEMES["ibvs, three points"][0].evaluate(seen(DOTS, X_CO))[1]
    four = SCHEMES["ibvs"][0].evaluate(seen(DOTS, X_CO))[1]
    assert interaction_rank(three) == 5
    assert interaction_rank(four) == 6


@given(st.integers(0, 2**32 - 1), st.integers(1, 5))
def test_the_rank_does_not_depend_on_units(seed, rank):
    random = np.random.default_rng(seed)
    L = random.standard_normal((8, rank)) @ random.standard_normal((rank, 6))
    millimetres = L * np.array([1.0, 1.0, 1.0, 1e-3, 1e-3, 1e-3])
    assert interaction_rank(L) == interaction_rank(millimetres) == rank
