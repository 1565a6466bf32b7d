"""The surface of a set of grid points, for pictures."""

from __future__ import annotations

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.workspaces.regions.volume import cells_inside


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
