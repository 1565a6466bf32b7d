"""Features about and along the optical axis: angle of a segment, size of a polygon.

alpha is the angle of the directed segment between two image points, sigma the square root of the
area of a polygon of image points. A rotation of the camera about the optical axis changes alpha by
its negative and leaves sigma; a translation along it leaves alpha and sigma's logarithm rises by
v_z / Z, where segment and polygon are parallel to the image.

Source: Corke and Hutchinson, A new partitioned approach to image-based visual servo control, 2001;
the logarithm of sigma, and both against their desired values, are chosen here.
"""

from __future__ import annotations

import math

from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.servoing.packed_features_kernel import points_packed

AXIS_FEATURES = 2
"""alpha and ln sigma, the last rows."""

SEGMENT, ANGLE, LOG_SIZE, ORIENTATION, ORDER = 0, 2, 3, 4, 5
"""Where the numbers of `partitioned_packed` begin: the segment's ends, alpha and ln sigma that are
desired, sign of the polygon's area, and the polygon's corners in their order. Ends and corners
count among the chosen points."""

LEAST_AREA = 1e-12
"""Area of a polygon that counts as seen edge-on, at unit focal length [-]: a millionth of the
image's focal length, squared. Its size then says nothing of the depth."""

LEAST_SQUARE = 1e-12
"""The same for the square of the segment's length."""


@njit(cache=True)
def segment_angle_into(first: int, last: int, s: Array, L: Array, row: int) -> None:
    """s[row], L[row] <- alpha [rad] of the segment from point `first` to `last`, and its rates.

    Args:
        first: Number of a point, whose image is s[2 first : 2 first + 2].
        last: The same of another one.
        s: Images of points, then what is written, shape (k,).
        L: Interaction matrix of the points, then what is written, shape (k, 6).
        row: Where.
    """
    a, b = 2 * first, 2 * last
    dx, dy = s[b] - s[a], s[b + 1] - s[a + 1]
    square = max(dx * dx + dy * dy, LEAST_SQUARE)
    s[row] = math.atan2(dy, dx)
    for j in range(6):
        L[row, j] = (dx * (L[b + 1, j] - L[a + 1, j]) - dy * (L[b, j] - L[a, j])) / square


@njit(cache=True)
def polygon_size_into(order: Array, orientation: float, s: Array, L: Array, row: int) -> None:
    """s[row], L[row] <- ln sigma [-] of a polygon, and its rates; zero for one seen edge-on.

    Args:
        order: Numbers of the polygon's corners in their order, shape (n,).
        orientation: Sign of the area that they enclose in this order, 1 or -1.
        s: As in `segment_angle_into`.
        L: The same.
        row: The same.
    """
    area = 0.0
    for j in range(6):
        L[row, j] = 0.0
    for q in range(order.shape[0]):
        a, b = 2 * int(order[q]), 2 * int(order[(q + 1) % order.shape[0]])
        area += 0.5 * orientation * (s[a] * s[b + 1] - s[b] * s[a + 1])
        for j in range(6):
            L[row, j] += (
                0.25
                * orientation
                * (
                    L[a, j] * s[b + 1]
                    + s[a] * L[b + 1, j]
                    - L[b, j] * s[a + 1]
                    - s[b] * L[a + 1, j]
                )
            )
    s[row] = 0.5 * math.log(max(area, LEAST_AREA))
    for j in range(6):
        L[row, j] = L[row, j] / area if area > LEAST_AREA else 0.0


@njit(cache=True)
def partitioned_packed(numbers: Array, seen: Array, s: Array, L: Array) -> None:
    """`PartitionedFeatures`; numbers: see `SEGMENT`, then those of `points_packed`."""
    points = s.shape[0] - AXIS_FEATURES
    n = points // 2
    points_packed(numbers[ORDER + n :], seen, s[:points], L[:points])
    segment_angle_into(int(numbers[SEGMENT]), int(numbers[SEGMENT + 1]), s, L, points)
    turn = s[points] - numbers[ANGLE]
    s[points] = math.atan2(math.sin(turn), math.cos(turn))
    polygon_size_into(numbers[ORDER : ORDER + n], numbers[ORIENTATION], s, L, points + 1)
    s[points + 1] -= numbers[LOG_SIZE]
