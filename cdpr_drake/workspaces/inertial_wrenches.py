"""Wrenches that stand for all motions of a turning platform in a range of orientations.

With a the acceleration of the centre of mass Co in W and c = p_PCo in W, a rigid platform loads its
cables about Po with

    F_P_W = -(c x m a + R n, m a),    n = I_Co alpha + w x I_Co w  in P,

whatever its angular velocity w and acceleration alpha are: the gyroscopic term is in the moment n
about Co. So it is enough to bound a in W and n in P, and how R differs from its middle.

Source: Siciliano and Khatib (eds.), Springer handbook of robotics, 2nd ed., section 3.3 (Newton and
Euler); the bounds are first-order exact in the ranges of the angles.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet

LEAST_MOMENT = 1e-3
"""Moments about axes without angular acceleration may be this share of the largest one, so that
roundings of a turn about another axis are within them."""

CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))


def inertia_about_mass_centre(mass: float, p_PCo: Array, I_PPo: Array) -> Array:
    """Rotational inertia about Co in P, shape (3, 3) [kg m^2], from that about Po."""
    c = np.asarray(p_PCo, float)
    return np.asarray(I_PPo - mass * (c @ c * np.eye(3) - np.outer(c, c)), float)


def moment_box(mass: float, p_PCo: Array, I_PPo: Array, angular: Array) -> Array:
    """Half widths of the moments n in P that angular accelerations ask at rest, shape (3,) [N m].

    Args:
        mass: Mass [kg].
        p_PCo: Centre of mass in P, shape (3,) [m].
        I_PPo: Rotational inertia about Po in P, shape (3, 3) [kg m^2].
        angular: Half widths of angular accelerations in P, shape (3,), at least 0, one above
            [rad/s^2].
    """
    found = np.abs(inertia_about_mass_centre(mass, p_PCo, I_PPo)) @ np.asarray(angular, float)
    return np.asarray(np.maximum(found, LEAST_MOMENT * np.max(found)), float)


def turn_bounds(middle: Array, halves: Array) -> tuple[Array, Array]:
    """Bounds of |E| and |E - 1|, entry by entry, of E = R_middle' R over a range of angles.

    E is a turn by each angle's difference about an axis that is fixed in P at the middle: with
    R = Rx Ry Rz about (Ry Rz)' x, then Rz' y, then z.

    Args:
        middle: phi, theta, psi, shape (3,) [rad].
        halves: Half widths of their ranges, shape (3,) [rad].

    Returns:
        Both, shape (3, 3) each.
    """
    turned = [rotation_from_angles(np.where(np.arange(3) > k, middle, 0.0)) for k in (0, 1)]
    axes = [turned[0].matrix().T[:, 0], turned[1].matrix().T[:, 1], np.array([0.0, 0.0, 1.0])]
    size, change = np.eye(3), np.eye(3)
    for axis, half in zip(axes, np.asarray(halves, float), strict=True):
        x, y, z = axis
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        sine, rest = np.sin(min(half, np.pi / 2.0)), 1.0 - np.cos(min(half, np.pi))
        off = sine * np.abs(cross) + rest * np.abs(cross @ cross)
        size = size @ (off - np.diag(np.diag(off)) + np.eye(3))
        change = change @ (np.eye(3) + off)
    return size, change - np.eye(3)


def turning_wrenches(
    mass: float, p_PCo: Array, moments: Array, accelerations: Array,
    middle: Array, halves: Array,
) -> SpatialSet:  # fmt: skip
    """External wrenches about Po in W that stand for every motion within bounds, at any velocity.

    Args:
        mass: Mass [kg].
        p_PCo: Centre of mass in P, shape (3,) [m].
        moments: Half widths of n about Co in P, shape (3,) [N m].
        accelerations: Half widths of a of Co in W, shape (3,) [m/s^2].
        middle: Middle of the range of orientations (phi, theta, psi), shape (3,) [rad].
        halves: Half widths of the range, shape (3,) [rad].
    """
    R = rotation_from_angles(np.asarray(middle, float)).matrix()
    size, change = turn_bounds(middle, halves)
    force = mass * np.asarray(accelerations, float)
    # In P at the middle: E n, and (E - 1) c x f, which c at the middle leaves out.
    g, d = np.abs(R.T) @ force, change @ np.abs(np.asarray(p_PCo, float))
    lever = np.array(
        [d[1] * g[2] + d[2] * g[1], d[2] * g[0] + d[0] * g[2], d[0] * g[1] + d[1] * g[0]]
    )
    half = size @ np.asarray(moments, float) + lever
    forces, turns = CORNERS * force, (CORNERS * half) @ R.T
    about = np.cross(R @ p_PCo, forces)
    rows = [-np.concatenate([a + n, f]) for a, f in zip(about, forces, strict=True) for n in turns]
    return SpatialSet(vertices=np.array(rows))
