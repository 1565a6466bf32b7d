"""The feasible polygon against SciPy's half-space intersection, and the points chosen on it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, HalfspaceIntersection

from cdpr_drake.tensions.polygon_kernel import (
    polygon_barycenter,
    polygon_steiner_point,
    polygon_vertices,
)

BOUND_TOLERANCE = 1e-12  # relative to the tensions; corners come from cuts of two bounds
AREA_TOLERANCE = 1e-7  # relative; Qhull joins facets that are nearly parallel
CENTER_TOLERANCE = 1e-7  # relative to the polygon's width, as the area
THIN = 1e-3  # width over tensions; in thinner polygons Qhull's intersections lose digits
ROUNDING = 1e-14  # of numbers of size one

# Arrays in the order of C, as the polygons are of which points are chosen: for another order the
# kernels would be compiled again.
SQUARE = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]).T.copy()


@st.composite
def strips(draw):
    """A point, a basis of a plane and bounds: lower <= t + N' eta <= upper."""
    m = draw(st.integers(2, 9))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    N = np.linalg.qr(rng.normal(size=(m, 2)))[0].T.copy()
    upper = rng.uniform(20.0, 60.0, m)
    lower = rng.uniform(0.0, 10.0, m)
    point = lower + (upper - lower) * rng.uniform(-0.2, 1.2, m)
    return point, N, lower, upper


def halfspaces(t, N, lower, upper):
    """Rows a, b of a eta + b <= 0."""
    return np.vstack([np.column_stack([N.T, t - upper]), np.column_stack([-N.T, lower - t])])


def inner_circle(planes):
    """Centre and radius of the largest circle within; the radius is negative if it is empty."""
    lengths = np.linalg.norm(planes[:, :2], axis=1)
    result = linprog(
        [0.0, 0.0, -1.0],
        A_ub=np.column_stack([planes[:, :2], lengths]),
        b_ub=-planes[:, 2],
        bounds=[(None, None)] * 3,
        method="highs",
    )
    assert result.success
    return result.x[:2], result.x[2]


def signed_area(vertices):
    x, y = vertices - vertices[:, :1]
    return 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))


def hull_centroid(hull):
    """Mean of the centroids of a fan of triangles, weighted by area."""
    corners = hull.points[hull.vertices]
    a, b = corners[1:-1] - corners[0], corners[2:] - corners[0]
    areas = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return corners[0] + areas @ (a + b) / (3.0 * np.sum(areas))


@given(strips())
def test_corners_keep_all_bounds_and_go_round_counterclockwise(strip):
    t, N, lower, upper = strip
    vertices = polygon_vertices(*strip)
    tensions = t[:, np.newaxis] + N.T @ vertices
    rounding = BOUND_TOLERANCE * np.max(upper)
    assert np.all(tensions >= lower[:, np.newaxis] - rounding)
    assert np.all(tensions <= upper[:, np.newaxis] + rounding)
    if vertices.shape[1] > 2:
        assert signed_area(vertices) >= 0.0
        edges = np.roll(vertices, -1, axis=1) - vertices
        turns = edges[0] * np.roll(edges[1], -1) - edges[1] * np.roll(edges[0], -1)
        assert np.all(turns >= -BOUND_TOLERANCE * np.max(upper) ** 2)


@given(strips())
def test_area_and_centroid_are_those_of_scipys_half_spaces(strip):
    vertices = polygon_vertices(*strip)
    planes = halfspaces(*strip)
    center, radius = inner_circle(planes)
    width = THIN * np.max(strip[3])
    if radius < width:
        if radius < -width:
            assert vertices.shape == (2, 0)
        return
    hull = ConvexHull(HalfspaceIntersection(planes, center).intersections)
    assert signed_area(vertices) == pytest.approx(hull.volume, rel=AREA_TOLERANCE)
    extent = np.max(np.ptp(vertices, axis=1))
    np.testing.assert_allclose(
        polygon_barycenter(vertices), hull_centroid(hull), rtol=0.0, atol=CENTER_TOLERANCE * extent
    )


@given(strips())
def test_the_chosen_points_lie_in_the_polygon(strip):
    vertices = polygon_vertices(*strip)
    if vertices.shape[1] == 0:
        return
    planes = halfspaces(*strip)
    for choose in (polygon_barycenter, polygon_steiner_point):
        beyond = planes[:, :2] @ choose(vertices) + planes[:, 2]
        assert np.max(beyond) <= BOUND_TOLERANCE * np.max(strip[3])


def box(lower, upper):
    """Two cables that are the coordinates of the plane, and one that is their sum."""
    N = np.array([[1.0, 0.0, 1.0], [0.0, 1.0, 1.0]])
    return polygon_vertices(np.zeros(3), N, np.array(lower, float), np.array(upper, float))


def test_a_square_cut_by_a_third_cable():
    vertices = box([0, 0, 0], [1, 1, 1.5])
    corners = {(0.0, 0.0), (1.0, 0.0), (1.0, 0.5), (0.5, 1.0), (0.0, 1.0)}
    assert {tuple(corner) for corner in vertices.T.round(12)} == corners
    assert signed_area(vertices) == pytest.approx(1.0 - 0.125, rel=1e-14)


@pytest.mark.parametrize(
    ("lower", "upper", "middle"),
    [
        ([0, 0.5, 0], [1, 0.5, 9], (0.5, 0.5)),  # one tension is given: a segment
        ([0, 0, 1], [1, 1, 1], (0.5, 0.5)),  # the third one is: a diagonal
        ([0.25, 0.75, 0], [0.25, 0.75, 9], (0.25, 0.75)),  # two are: a point
        ([0, 0, 0], [1, 1, 0], (0.0, 0.0)),  # only a corner is left
    ],
)
def test_polygons_without_area(lower, upper, middle):
    vertices = box(lower, upper)
    assert vertices.shape[1] >= 1
    assert signed_area(vertices) == pytest.approx(0.0, abs=ROUNDING)
    for choose in (polygon_barycenter, polygon_steiner_point):
        np.testing.assert_allclose(choose(vertices), middle, rtol=0.0, atol=ROUNDING)


@pytest.mark.parametrize(
    ("lower", "upper"), [([0, 0, 3], [1, 1, 4]), ([0.5, 0.5, 0], [1, 1, 0.999999])]
)
def test_bounds_that_cannot_meet_leave_nothing(lower, upper):
    assert box(lower, upper).shape == (2, 0)


def test_a_regular_polygon_is_balanced_about_its_middle():
    angles = 2.0 * np.pi * np.arange(7) / 7
    vertices = np.array([3.0 + np.cos(angles), -2.0 + np.sin(angles)])
    for choose in (polygon_barycenter, polygon_steiner_point):
        np.testing.assert_allclose(choose(vertices), [3.0, -2.0], rtol=0.0, atol=10 * ROUNDING)


def test_the_points_of_a_triangle_are_as_by_hand():
    """Right angle at the origin: the centroid, and the corners weighted by exterior angles."""
    vertices = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]).T.copy()
    np.testing.assert_allclose(polygon_barycenter(vertices), [1 / 3, 1 / 3], rtol=1e-14)
    np.testing.assert_allclose(polygon_steiner_point(vertices), [3 / 8, 3 / 8], rtol=1e-14)


@given(st.floats(-1.0, 1.0), st.integers(0, 2**32 - 1))
def test_the_points_move_with_the_polygon(turn, seed):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(8, 2))
    vertices = points[ConvexHull(points).vertices].T.copy()
    c, s = np.cos(turn), np.sin(turn)
    R, p = np.array([[c, -s], [s, c]]), rng.normal(size=2)
    for choose in (polygon_barycenter, polygon_steiner_point):
        moved = choose(np.ascontiguousarray(R @ vertices + p[:, np.newaxis]))
        np.testing.assert_allclose(moved, R @ choose(vertices) + p, rtol=0.0, atol=1e3 * ROUNDING)


@pytest.mark.parametrize("cut", [1e-3, 1e-6, 1e-9, 1e-12])
def test_a_corner_that_is_cut_off_moves_the_points_by_no_more_than_the_cut(cut):
    cut_off = np.array(
        [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0 - cut), (1.0 - cut, 1.0), (0.0, 1.0)]
    ).T.copy()
    for choose in (polygon_barycenter, polygon_steiner_point):
        moved = np.linalg.norm(choose(cut_off) - choose(SQUARE))
        assert moved <= cut + ROUNDING


@pytest.mark.parametrize("dx", [-2e-16, 0.0, 2e-16])
@pytest.mark.parametrize("dy", [-2e-16, 0.0, 2e-16])
def test_a_corner_that_is_there_twice_up_to_rounding_counts_once(dx, dy):
    """The edge between the two has any direction, even backwards."""
    twice = np.array(
        [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (1.0 + dx, 1.0 + dy), (0.0, 1.0)]
    ).T.copy()
    for choose in (polygon_barycenter, polygon_steiner_point):
        np.testing.assert_allclose(choose(twice), [0.5, 0.5], rtol=0.0, atol=10 * ROUNDING)


def three_bounds_through_a_corner():
    """Polygons of which a corner is where three bounds meet, the second one shifted outwards."""
    rng = np.random.default_rng(0)
    for _ in range(400):
        N = np.linalg.qr(rng.normal(size=(6, 2)))[0].T.copy()
        corner = 2.0 * rng.normal(size=2)
        t, lower, upper = np.full(6, 5.0), np.zeros(6), np.full(6, 10.0)
        lower[:3] = t[:3] + N[:, :3].T @ corner
        if np.any(lower > upper):
            continue
        polygons = []
        for shift in (0.0, 1e-9, -1e-9):
            moved = lower.copy()
            moved[1] -= shift
            polygons.append(polygon_vertices(t, N, moved, upper))
        # A shift of a bound moves a corner by at most this over the sine between two bounds.
        if all(len(p[0]) > 2 and signed_area(p) > 1.0 for p in polygons):
            yield polygons


def test_where_three_bounds_meet_the_points_do_not_jump():
    """Steps of 1e-9 N of a bound; bounds may meet at small angles, which lengthens them."""
    jumps = 0.0
    count = 0
    for polygons in three_bounds_through_a_corner():
        count += 1
        for choose in (polygon_barycenter, polygon_steiner_point):
            points = [choose(polygon) for polygon in polygons]
            jumps = max(jumps, *(np.linalg.norm(point - points[0]) for point in points[1:]))
    assert count > 50
    assert jumps <= 1e-6
