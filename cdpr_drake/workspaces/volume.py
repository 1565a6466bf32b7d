"""Volume of the part of a grid that belongs to a workspace, and its surface for pictures.

`workspace_volume` measures a set of grid points by one of three rules; `surface_quads` gives the
faces of the cells all of whose corners are inside.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from itertools import product

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from cdpr_drake.arrays import Array
from cdpr_drake.errors import WorkspaceGridError

FLAT_SHARE = 1e-9
"""Points that spread less than this in some direction, relative to their extent, are flat."""


class VolumeRule(StrEnum):
    """How the volume of a set of grid points is counted.

    POINTS: each point stands for the cell around it, cut at the box (the trapezoidal rule).
    CORNERS: the cells between the points count whose corners are all inside.
    HULL: the convex hull of the points inside, which also counts holes and dents.

    A set that fills the grid has the volume of the box by every rule. CORNERS is never more than
    POINTS or HULL.
    """

    POINTS = "points"
    CORNERS = "corners"
    HULL = "hull"


@dataclass(frozen=True)
class WorkspaceVolume:
    """The volume of a set by one rule.

    Attributes:
        rule: The rule.
        value: Volume [m^3]; of a grid in one plane the area [m^2], in one line the length [m].
        full: The same of the whole grid.
        unit: m^3, m^2, m, or - for a grid of one point.
    """

    rule: VolumeRule
    value: float
    full: float
    unit: str

    @property
    def share(self) -> float:
        """Share of the grid's box, 0 to 1."""
        return self.value / self.full


def workspace_volume(
    inside: np.ndarray, axes: tuple[Array, Array, Array], rule: VolumeRule | str
) -> WorkspaceVolume:
    """Volume of the points of a grid that are inside.

    Axes of one point do not count: a planar robot's workspace is an area.

    Args:
        inside: Which points belong to the set, shape (nx, ny, nz), true or false.
        axes: Coordinates along x, y, z, ascending and evenly spaced, shape (n,) [m].
        rule: The rule.

    Raises:
        WorkspaceGridError: The sizes do not fit, or an axis is empty.
    """
    rule = VolumeRule(rule)
    wanted = tuple(len(axis) for axis in axes)
    if np.shape(inside) != wanted or 0 in wanted:
        raise WorkspaceGridError(
            f"volume: found values of shape {np.shape(inside)} on axes of {wanted} points; "
            "accepted: the same, not empty"
        )
    used = [axis for axis in axes if len(axis) > 1]
    mask = np.asarray(inside, bool).reshape([len(axis) for axis in used])
    lengths = [float(axis[-1] - axis[0]) for axis in used]
    full = float(np.prod(lengths))
    if rule == VolumeRule.POINTS:
        value = _points_share(mask) * full
    elif rule == VolumeRule.CORNERS:
        value = corner_share(mask) * full
    else:
        value = _hull(mask, used)
    return WorkspaceVolume(rule, value, full, ("-", "m", "m^2", "m^3")[len(used)])


def cells_inside(inside: np.ndarray) -> np.ndarray:
    """Which cells between the points of a grid have all their corners inside.

    Args:
        inside: Which points are inside, any dimension d, shape (n1, ..., nd).

    Returns:
        Shape (n1 - 1, ..., nd - 1); 2^d corners each.
    """
    cells = np.asarray(inside, bool)
    for axis in range(cells.ndim):
        first = np.take(cells, range(cells.shape[axis] - 1), axis)
        last = np.take(cells, range(1, cells.shape[axis]), axis)
        cells = first & last
    return cells


def corner_share(inside: np.ndarray) -> float:
    """Share of the cells whose corners are all inside, 0 to 1; argument as `cells_inside`."""
    cells = cells_inside(inside)
    return float(np.count_nonzero(cells)) / cells.size


def cell_hull_share(inside: np.ndarray) -> float:
    """Share of a grid's box in the convex hulls of each cell's inside corners, 0 to 1.

    A cell with all corners inside counts whole, one without a corner lacks the tetrahedron of that
    corner, a sixth of a cell, and so on: what an alpha shape of the points makes of a regular grid
    where its balls are just larger than a cell. Never less than `corner_share`, never more than
    the share of the convex hull of all points.

    Args:
        inside: Which points are inside, of a grid in one to three dimensions d, shape
            (n1, ..., nd), each n at least 2.
    """
    corners = np.asarray(inside, bool)
    code = np.zeros([n - 1 for n in corners.shape], int)
    for number, corner in enumerate(product((0, 1), repeat=corners.ndim)):
        ends = [slice(k, n - 1 + k) for k, n in zip(corner, corners.shape, strict=True)]
        code += corners[tuple(ends)].astype(int) << number
    return float(np.mean(_cell_hulls(corners.ndim)[code]))


@cache
def _cell_hulls(dimensions: int) -> Array:
    """Volume of the convex hull of some corners of a unit cell, by their numbers as bits."""
    corners = np.array(list(product((0.0, 1.0), repeat=dimensions)))
    codes = np.arange(1 << len(corners))
    axes = [np.array([0.0, 1.0])] * dimensions
    shape = (2,) * dimensions
    return np.array(
        [_hull(((c >> np.arange(len(corners))) & 1).astype(bool).reshape(shape), axes)
         for c in codes]
    )  # fmt: skip


def _points_share(mask: np.ndarray) -> float:
    """Weights 1 inside, 1/2 on a face of the box, 1/4 on an edge and 1/8 at its corners."""
    share = mask.astype(float)
    for _ in range(mask.ndim):
        weights = np.ones(len(share))
        weights[[0, -1]] = 0.5
        share = np.tensordot(weights / (len(weights) - 1), share, axes=(0, 0))
    return float(share)


def _hull(mask: np.ndarray, axes: list[Array]) -> float:
    if not np.any(mask):
        return 0.0
    if mask.ndim == 0:
        return 1.0
    points = np.stack([axis[i] for axis, i in zip(axes, np.nonzero(mask), strict=True)], axis=-1)
    if mask.ndim == 1:
        return float(np.ptp(points))
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if len(points) <= mask.ndim or spread[-1] <= FLAT_SHARE * spread[0]:
        return 0.0  # flat
    try:
        return float(ConvexHull(points).volume)
    except QhullError:  # flat up to what Qhull can tell
        return 0.0


def surface_quads(inside: np.ndarray, axes: tuple[Array, Array, Array]) -> Array:
    """Faces of the solid of all cells whose eight corners are inside.

    On axes of which one has a single point, the squares whose four corners are inside.

    Args:
        inside: Which points belong to the set, shape (nx, ny, nz).
        axes: Coordinates along x, y, z, ascending, shape (n,) [m].

    Returns:
        Corners of the faces, shape (k, 4, 3) [m], counterclockwise seen from outside (of squares,
        seen from the positive side of the axis with one point).
    """
    flat = [k for k, axis in enumerate(axes) if len(axis) == 1]
    if len(flat) == 1:
        along = flat[0]
        squares = cells_inside(np.take(np.asarray(inside, bool), 0, along))
        first = np.array(np.nonzero(squares))
        return _faces(np.insert(first, along, 0, axis=0), along, True, axes)
    cells = np.pad(cells_inside(inside), 1)
    quads = []
    for along in range(3):
        here = np.take(cells, range(1, cells.shape[along]), along)
        before = np.take(cells, range(cells.shape[along] - 1), along)
        # A face lies between two cells of which one is inside; its normal points to the other.
        for outward, mask in ((True, before & ~here), (False, here & ~before)):
            index = np.array(np.nonzero(mask))
            for other in range(3):
                if other != along:
                    index[other] -= 1  # of the padding
            quads.append(_faces(index, along, outward, axes))
    return np.concatenate(quads)


def triangles(quads: Array) -> tuple[Array, np.ndarray]:
    """Quads, shape (k, 4, 3), as vertices, shape (n, 3), and triangles of them, shape (2 k, 3)."""
    vertices, number = np.unique(quads.reshape(-1, 3), axis=0, return_inverse=True)
    corners = number.reshape(-1, 4)
    return vertices, np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])


def _faces(index: np.ndarray, along: int, outward: bool, axes: tuple[Array, Array, Array]) -> Array:
    """Squares normal to an axis, from the numbers of their first corners, shape (3, k)."""
    u, v = (along + 1) % 3, (along + 2) % 3
    corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
    if not outward:
        corners.reverse()
    quads = np.empty((index.shape[1], 4, 3))
    for c, (du, dv) in enumerate(corners):
        for k in range(3):
            shift = du if k == u else dv if k == v else 0
            quads[:, c, k] = axes[k][index[k] + shift]
    return quads
