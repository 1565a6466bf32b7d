"""Motion types: which motions of its platform a cable robot has.

A point mass moves along a line (1T), in a plane (2T) or in space (3T), and turns nothing; a body
moves in a plane (2T1R, which Verhoeven calls 1R2T) or in space (3R3T); a beam moves in space, but
its turn about itself is none that cables could tell (2R3T). What a platform cannot move, something
else holds or nothing excites: forces and moments there do not count.

Source: Gazebo thesis 5.3, its classes of robots with a point mass and with a body (the boxes of its
second list repeat the first by a printing error); Verhoeven, 2004, 3.1, for the names.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError, accepted_names
from cdpr_drake.geometry.motion_kernel import Motion
from cdpr_drake.geometry.straight_cables import ALL_ROWS, PLANAR_ROWS

MOTION_TYPES = {
    "1T": "a point mass on a line",
    "2T": "a point mass in a plane",
    "3T": "a point mass in space",
    "2T1R": "a body in a plane",
    "1R2T": "a body in a plane, the other name of 2T1R",
    "2R3T": "a beam in space, whose turn about itself does not count",
    "3R3T": "a body in space",
}
"""The motion types, with what the platform of each is."""

_TURNS = {"2T1R": 1, "1R2T": 1, "2R3T": 2, "3R3T": 3}
_MOVES = {"1T": 1, "2T": 2, "2T1R": 2, "1R2T": 2}

_STRAIGHT = 1e-12
"""How far an axis may be off one of W to count as it."""

_COMPONENTS = (
    "moment about x", "moment about y", "moment about z", "force along x", "force along y",
    "force along z",
)  # fmt: skip


@dataclass(frozen=True)
class MotionType:
    """Which motions a platform has.

    Attributes:
        name: One of `MOTION_TYPES`.
        axis: A unit vector: of 1T the line's direction in W, of the types in a plane its normal in
            W, of 2R3T the beam's direction in P; not read otherwise.
    """

    name: str = "3R3T"
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        """Normalises the axis.

        Raises:
            CableGeometryError: There is no such type, or the axis is none.
        """
        if self.name not in MOTION_TYPES:
            raise CableGeometryError(
                f"motion: found {self.name}; {accepted_names(self.name, MOTION_TYPES)}"
            )
        axis = np.asarray(self.axis, float)
        size = float(np.linalg.norm(axis)) if axis.shape == (3,) else 0.0
        if not (np.isfinite(size) and size > 0.0):
            raise CableGeometryError(f"axis: found {self.axis}; accepted: a direction, not zero")
        x, y, z = axis / size + 0.0
        object.__setattr__(self, "axis", (float(x), float(y), float(z)))

    @property
    def num_turns(self) -> int:
        """Rotations that it has."""
        return _TURNS.get(self.name, 0)

    @property
    def num_moves(self) -> int:
        """Translations that it has."""
        return _MOVES.get(self.name, 3)

    @property
    def freedom(self) -> int:
        """Degrees of freedom, n."""
        return self.num_turns + self.num_moves

    @property
    def is_free(self) -> bool:
        """Whether it is 3R3T."""
        return self.name == "3R3T"

    @property
    def is_point(self) -> bool:
        """Whether the platform is a point mass."""
        return self.num_turns == 0

    @property
    def is_plane(self) -> bool:
        """Whether the platform moves in a plane."""
        return self.num_moves == 2

    @property
    def is_horizontal_body(self) -> bool:
        """Whether the platform is a body in a horizontal plane, rows `PLANAR_ROWS`."""
        return self.rows == PLANAR_ROWS

    @cached_property
    def rows(self) -> tuple[int, ...] | None:
        """Components of a spatial vector in W that it has; None where they are no axes of W."""
        if self.name in ("3R3T", "3T"):
            return ALL_ROWS[6 - self.freedom :]
        along = np.abs(self.axis)
        k = int(np.argmax(along))
        if self.name == "2R3T" or np.delete(along, k).max() > _STRAIGHT:
            return None
        if self.name == "1T":
            return (3 + k,)
        return (*([k] if self.num_turns else []), *(3 + i for i in range(3) if i != k))

    def basis(self, R_WP: Array) -> Array:
        """Twists (rotation, translation) in W that it has, orthonormal columns, shape (6, n).

        Args:
            R_WP: Orientation of the platform, shape (3, 3); read for 2R3T only.
        """
        B = np.zeros((6, self.freedom))
        if self.rows is not None:
            B[list(self.rows), range(self.freedom)] = 1.0
            return B
        axis = np.asarray(self.axis)
        if self.name == "2R3T":
            B[:3, :2] = R_WP @ across(axis)
            B[3:, 2:] = np.eye(3)
        elif self.name == "1T":
            B[3:, 0] = axis
        else:
            if self.num_turns:
                B[:3, 0] = axis
            B[3:, self.num_turns :] = across(axis)
        return B

    def columns(self, J: Array, R_WP: Array) -> Array:
        """A matrix that takes a twist in W, shape (k, 6), for those that it has, shape (k, n)."""
        if self.is_free:
            return J
        if self.rows is not None:
            return J[:, list(self.rows)]
        return np.asarray(J @ self.basis(R_WP), float)

    def components(self, wrench: Array, R_WP: Array) -> Array:
        """A wrench about Po in W, or rows that give one, shape (6, ...), where it works: (n, ...).

        Where all forces here are 0, the platform is at rest.
        """
        if self.is_free:
            return wrench
        if self.rows is not None:
            return wrench[list(self.rows)]
        return np.asarray(self.basis(R_WP).T @ wrench, float)

    def part(self, K: Array, R_WP: Array) -> Array:
        """A matrix of twists and wrenches in W, shape (6, 6), for what it has, shape (n, n)."""
        if self.rows is not None:
            return K[np.ix_(self.rows, self.rows)]
        B = self.basis(R_WP)
        return np.asarray(B.T @ K @ B, float)

    def twist(self, displacement: Array, R_WP: Array) -> Array:
        """The twist in W of components as `basis` has them, shape (n, ...) in, (6, ...) out."""
        displacement = np.asarray(displacement, float)
        if self.rows is None:
            return np.asarray(self.basis(R_WP) @ displacement, float)
        six = np.zeros((6, *displacement.shape[1:]))
        six[list(self.rows)] = displacement
        return six

    def words(self) -> tuple[str, ...]:
        """What the wrench's components are called, n of them, as `basis` has them."""
        if self.rows is not None:
            return tuple(_COMPONENTS[k] for k in self.rows)
        a = "(" + ", ".join(f"{x:.4g}" for x in self.axis) + ")"
        if self.name == "1T":
            return (f"force along {a}",)
        if self.name == "2R3T":
            return (
                "moment across the beam",
                "other moment across the beam",
                *_COMPONENTS[3:],
            )
        forces = [f"force along {_vector(column)}" for column in across(np.asarray(self.axis)).T]
        return (*([f"moment about {a}"] if self.num_turns else []), *forces)

    def packed(self) -> Array:
        """Numbers of rotations and translations, and the axis, shape (5,), for `keep_free`."""
        return np.array([float(self.num_turns), float(self.num_moves), *self.axis])


FREE, LEVEL = MotionType(), MotionType("2T1R")
"""A body in space, and one in a horizontal plane."""


def across(axis: Array) -> Array:
    """Two unit vectors e, f with e x f along a unit vector, columns, shape (3, 2).

    Of an axis of W they are the two other axes of W, in cyclic order.
    """
    k = int(np.argmax(np.abs(axis)))
    e = np.zeros(3)
    e[(k + 1) % 3] = 1.0
    e -= axis * (e @ axis)
    e /= np.linalg.norm(e)
    return np.column_stack([e, np.cross(axis, e)]) + 0.0


def _vector(values: Array) -> str:
    return "(" + ", ".join(f"{value + 0.0:.4g}" for value in np.round(values, 9)) + ")"


@njit(cache=True, error_model="numpy")
def write_projection(free: Array, X: Motion, P: Array) -> None:
    """Writes the projection of twists in W on those that a platform has, shape (6, 6).

    Args:
        free: `MotionType.packed()`, shape (5,).
        X: Pose of the platform, see `floating_motion`.
        P: Where it is written.
    """
    P[:] = 0.0
    turns, moves = free[0], free[1]
    ax, ay, az = free[2], free[3], free[4]
    if turns == 2.0:  # the axis is the beam's, in P
        ax, ay, az = (
            X[0] * ax + X[1] * ay + X[2] * az,
            X[3] * ax + X[4] * ay + X[5] * az,
            X[6] * ax + X[7] * ay + X[8] * az,
        )
    axis = (ax, ay, az)
    for i in range(3):
        for j in range(3):
            one = 1.0 if i == j else 0.0
            along = axis[i] * axis[j]
            if turns == 3.0:
                P[i, j] = one
            elif turns == 2.0:
                P[i, j] = one - along
            elif turns == 1.0:
                P[i, j] = along
            if moves == 3.0:
                P[3 + i, 3 + j] = one
            elif moves == 2.0:
                P[3 + i, 3 + j] = one - along
            else:
                P[3 + i, 3 + j] = along


@njit(cache=True, error_model="numpy")
def keep_free(free: Array, X: Motion, g: Array, H: Array) -> None:
    """Makes equations H x = g say that motions which a platform has not are 0.

    H becomes P H P + (1 - P) and g P g, with P of `write_projection`; nothing happens for 3R3T.

    Args:
        free: `MotionType.packed()`, shape (5,).
        X: Pose of the platform.
        g: Shape (6,), written in place.
        H: Shape (6, 6), symmetric, of which the lower half is read; written in place.
    """
    if free[0] == 3.0:
        return
    P, half, kept = np.empty((6, 6)), np.empty((6, 6)), np.empty(6)
    write_projection(free, X, P)
    for i in range(6):
        total = 0.0
        for j in range(6):
            total += P[i, j] * g[j]
            s = 0.0
            for k in range(6):
                s += P[i, k] * (H[k, j] if k >= j else H[j, k])
            half[i, j] = s
        kept[i] = total
    for i in range(6):
        g[i] = kept[i]
        for j in range(6):
            s = (1.0 if i == j else 0.0) - P[i, j]
            for k in range(6):
                s += half[i, k] * P[k, j]
            H[i, j] = s
