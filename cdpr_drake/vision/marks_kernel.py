"""Numba kernels that bring marks of targets to unit focal length.

A camera is given by the numbers of its pinhole: fx, fy, cx, cy [px].
"""

from __future__ import annotations

from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.features import ELLIPSE_SIZE


@njit(cache=True)
def normalize_points(marks: Array, camera: Array, out: Array) -> None:
    """Points (u, v), one after the other, shape (2 n,) [px], to all x and then all y, shape (2 n,).

    Args:
        marks: The points.
        camera: Shape (4,).
        out: Overwritten [-].
    """
    n = marks.shape[0] // 2
    for k in range(n):
        out[k] = (marks[2 * k] - camera[2]) / camera[0]
        out[n + k] = (marks[2 * k + 1] - camera[3]) / camera[1]


@njit(cache=True)
def normalize_ellipses(marks: Array, camera: Array, out: Array) -> None:
    """Ellipses (u, v, n20, n11, n02), one after the other, shape (5 n,) [px, px^2], the same.

    Args:
        marks: The ellipses.
        camera: Shape (4,).
        out: Overwritten, shape (5 n,) [-].
    """
    fx, fy = camera[0], camera[1]
    for k in range(marks.shape[0] // ELLIPSE_SIZE):
        at = ELLIPSE_SIZE * k
        out[at] = (marks[at] - camera[2]) / fx
        out[at + 1] = (marks[at + 1] - camera[3]) / fy
        out[at + 2] = marks[at + 2] / (fx * fx)
        out[at + 3] = marks[at + 3] / (fx * fy)
        out[at + 4] = marks[at + 4] / (fy * fy)


@njit(cache=True)
def crossing_diagonals(marks: Array, camera: Array, out: Array) -> None:
    """Where the diagonals of four corners meet.

    Args:
        marks: Corners (u, v) around a square, shape (8,) [px].
        camera: Shape (4,).
        out: Overwritten, shape (2,) [-].
    """
    a, b, c, d = marks[0], marks[2], marks[4], marks[6]
    e, f, g, h = marks[1], marks[3], marks[5], marks[7]
    # (a, e) + share (c - a, g - e) lies on the line through (b, f) and (d, h).
    along_u, along_v, across_u, across_v = c - a, g - e, d - b, h - f
    share = ((b - a) * across_v - (f - e) * across_u) / (along_u * across_v - along_v * across_u)
    out[0] = (a + share * along_u - camera[2]) / camera[0]
    out[1] = (e + share * along_v - camera[3]) / camera[1]


@njit(cache=True)
def crossings_of_diagonals(marks: Array, camera: Array, out: Array) -> None:
    """`crossing_diagonals` of many images, marks shape (n, 8) [px], out shape (n, 2) [-]."""
    for k in range(marks.shape[0]):
        crossing_diagonals(marks[k], camera, out[k])
