"""Wrenches that are demanded of the cables: to bear, to resist, to accelerate."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import WrenchSetError
from cdpr_drake.workspaces.static_feasibility import StaticCase

SPATIAL = 6

MOST_CORNERS = 4096
"""Corners of all boxes and vertices together that one set may have where they are listed."""


def _zeros() -> Array:
    return np.zeros(SPATIAL)


@dataclass(frozen=True, eq=False)
class SpatialSet:
    """A convex set of wrenches on the platform about Po, or of spatial accelerations of Po, in W.

    It is the sum (each of one with each of the others) of a polytope, a box and an ellipsoid round
    zero; what is not wanted is left at zero. A planar platform feels only the components that it
    can move.

    Attributes:
        vertices: Vertices of the polytope, shape (k, 6): (moment, force) [N m, N] or (angular,
            linear) acceleration [rad/s^2, m/s^2].
        box: Half widths of the box along the components, shape (6,).
        ellipsoid: Semi-axes of the ellipsoid along the components, shape (6,).

    Raises:
        WrenchSetError: It is empty, unbounded, or a size is negative.
    """

    vertices: Array = field(default_factory=lambda: np.zeros((1, SPATIAL)))
    box: Array = field(default_factory=_zeros)
    ellipsoid: Array = field(default_factory=_zeros)

    def __post_init__(self) -> None:
        """Copies the arrays and checks them."""
        vertices = np.array(self.vertices, float)
        if vertices.ndim != 2 or vertices.shape[1:] != (SPATIAL,) or len(vertices) == 0:
            raise WrenchSetError(
                f"vertices: found shape {vertices.shape}; accepted: at least one, of 6 numbers"
            )
        if not np.all(np.isfinite(vertices)):
            raise WrenchSetError("vertices: found one without bounds; accepted: finite numbers")
        object.__setattr__(self, "vertices", vertices)
        for name in ("box", "ellipsoid"):
            value = np.array(getattr(self, name), float)
            if value.shape != (SPATIAL,):
                raise WrenchSetError(f"{name}: found shape {value.shape}; accepted: 6 numbers")
            if not np.all(np.isfinite(value) & (value >= 0.0)):
                raise WrenchSetError(
                    f"{name}: found {value.min():g} to {value.max():g}; accepted: finite sizes >= 0"
                )
            object.__setattr__(self, name, value)

    def is_zero(self) -> bool:
        """Whether zero is all that is in it."""
        return not (np.any(self.vertices) or np.any(self.box) or np.any(self.ellipsoid))

    def corners(self, rows: tuple[int, ...]) -> Array:
        """Points whose convex hull it is, in the components `rows`, shape (k, n).

        Raises:
            WrenchSetError: It has an ellipsoid, which is no polytope, or too many corners.
        """
        if np.any(self.ellipsoid[list(rows)]):
            raise WrenchSetError("ellipsoid: found one; accepted: a box or vertices, here")
        half = self.box[list(rows)]
        wide = np.flatnonzero(half)
        points = np.unique(self.vertices[:, list(rows)], axis=0)
        if len(points) * 2.0 ** len(wide) > MOST_CORNERS:
            raise WrenchSetError(
                f"vertices: found {len(points)} times {2 ** len(wide)} corners of a box; accepted: "
                f"at most {MOST_CORNERS}"
            )
        moves = np.zeros((2 ** len(wide), len(rows)))
        if len(wide):
            signs = np.array(np.meshgrid(*[[-1.0, 1.0]] * len(wide))).reshape(len(wide), -1).T
            moves[:, wide] = signs * half[wide]
        return np.asarray((points[:, np.newaxis] + moves).reshape(-1, len(rows)), float)


@dataclass(frozen=True, eq=False)
class Demand:
    """Wrenches W t that are demanded of the cables at n poses, in the rows that are balanced.

    Attributes:
        points: Vertices, shape (n, k, rows) [N m, N].
        spread: The set round each, T (box + ellipsoid), shape (n or 1, rows + 2, rows): T, half
            widths, semi-axes; as `wrench_facets_kernel.demand_reach` takes it.
    """

    points: Array
    spread: Array


def weight_wrenches(case: StaticCase, rotations: Array) -> Array:
    """Weight and further wrench about Po at poses, shape (n, 6) [N m, N]."""
    weight = case.force()
    p_PCo_W = np.asarray(rotations, float).reshape(-1, 3, 3) @ case.p_PCo
    forces = np.broadcast_to(weight, p_PCo_W.shape)
    return np.concatenate([np.cross(p_PCo_W, weight), forces], axis=-1) + case.wrench


def resisting(case: StaticCase, required: SpatialSet, rotations: Array) -> Demand:
    """What the cables must give so that the platform rests under every wrench of a set.

    Args:
        case: Platform, weight and further wrench.
        required: Wrenches on the platform beside these.
        rotations: R_WP, shape (n, 3, 3).

    Source: Bosscher, Riechel and Ebert-Uphoff, 2006; servoing thesis 1.2.2.
    """
    rows = list(case.rows)
    loads = weight_wrenches(case, rotations)[:, rows]
    points = -(loads[:, np.newaxis] + required.vertices[:, rows])
    spread = np.concatenate([np.eye(len(rows)), [required.box[rows]], [required.ellipsoid[rows]]])
    return Demand(points, spread[np.newaxis])


@dataclass(frozen=True, eq=False)
class MotionDemand:
    """Accelerations that a platform shall have at each of some velocities.

    Attributes:
        mass: Mass [kg].
        p_PCo: Centre of mass in P, shape (3,) [m].
        I_PPo: Rotational inertia about Po in P, shape (3, 3) [kg m^2].
        accelerations: Spatial accelerations (angular, linear) of Po in W.
        velocities: Spatial velocities (angular, linear) of P in W, shape (k, 6) [rad/s, m/s]; the
            linear part adds no wrench to a rigid platform.

    Raises:
        WrenchSetError: A velocity is not finite, or there is none.
    """

    mass: float
    p_PCo: Array
    I_PPo: Array
    accelerations: SpatialSet
    velocities: Array = field(default_factory=lambda: np.zeros((1, SPATIAL)))

    def __post_init__(self) -> None:
        """Checks the velocities."""
        v = np.array(self.velocities, float)
        if v.ndim != 2 or v.shape[1:] != (SPATIAL,) or not len(v) or not np.all(np.isfinite(v)):
            raise WrenchSetError(
                f"velocities: found shape {v.shape}, or one that is not finite; accepted: at least "
                "one, of 6 numbers"
            )
        object.__setattr__(self, "velocities", v)


def spatial_inertias(mass: float, p_PCo: Array, I_PPo: Array, rotations: Array) -> Array:
    """Spatial inertia about Po in W at poses, shape (n, 6, 6), (rotation, translation).

    Args:
        mass: Mass [kg].
        p_PCo: Centre of mass in P, shape (3,) [m].
        I_PPo: Rotational inertia about Po in P, shape (3, 3) [kg m^2].
        rotations: R_WP, shape (n, 3, 3).
    """
    R = np.asarray(rotations, float).reshape(-1, 3, 3)
    c = R @ p_PCo
    M = np.zeros((len(R), SPATIAL, SPATIAL))
    M[:, :3, :3] = R @ I_PPo @ R.transpose(0, 2, 1)
    M[:, 3:, 3:] = mass * np.eye(3)
    for k, unit in enumerate(np.eye(3)):
        M[:, :3, 3 + k] = mass * np.cross(c, unit)
        M[:, 3:, k] = mass * np.cross(unit, c)
    return M


def accelerating(case: StaticCase, motion: MotionDemand, rotations: Array) -> Demand:
    """What the cables must give for every acceleration of a set at every one of some velocities.

    With M the spatial inertia about Po in W, W t = M a + b(w) - weight and further wrench, where
    b(w) = (w x I w, m w x (w x c)), c the centre of mass from Po.

    Args:
        case: Weight and further wrench; its weight should be that of `motion.mass`.
        motion: The motion.
        rotations: R_WP, shape (n, 3, 3).

    Source: Gazebo thesis (2.17), with the sign of its (2.24); Barrette and Gosselin, 2005.
    """
    R = np.asarray(rotations, float).reshape(-1, 3, 3)
    rows = list(case.rows)
    c = R @ motion.p_PCo
    inertia = R @ motion.I_PPo @ R.transpose(0, 2, 1)
    M = spatial_inertias(motion.mass, motion.p_PCo, motion.I_PPo, R)
    w = motion.velocities[:, :3]
    turning = np.cross(w, np.einsum("nij,kj->nki", inertia, w))
    inward = motion.mass * np.cross(w, np.cross(w, c[:, np.newaxis]))
    bias = np.concatenate([turning, inward], axis=-1)
    a = motion.accelerations
    # A planar platform has no acceleration in the other components.
    M = M[:, rows][:, :, rows]
    pushed = np.einsum("nij,vj->nvi", M, a.vertices[:, rows])
    points = bias[:, :, np.newaxis, rows] + pushed[:, np.newaxis]
    points = points.reshape(len(R), -1, len(rows))
    points = points - weight_wrenches(case, R)[:, np.newaxis, rows]
    sizes = np.broadcast_to(np.stack([a.box[rows], a.ellipsoid[rows]]), (len(R), 2, len(rows)))
    return Demand(points, np.concatenate([M, sizes], axis=1))
