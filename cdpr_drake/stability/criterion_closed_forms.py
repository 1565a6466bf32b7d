"""Closed forms of a visual servo's stability where the robot's own model is exact.

Then the Jacobians of robot and estimate cancel, and what is left holds for any robot: analyses I
(only the object's pose is wrong) and II (the camera's mounting as well) of the servoing thesis.

Signs: `criterion` orders (rotation, translation) and counts a planar rotation positive where the
thesis has a minus, which mirrors the offsets (d_1, d_2) and no eigenvalue.

Source: servoing thesis 3.2.1 and 3.2.2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.servoing.pose_features import theta_u_interaction

TURN_STEP = math.radians(0.1)
"""Distance of the turns at which a range of turns is looked at [rad]."""

_CORNERS = np.array(list(product((-1.0, 1.0), repeat=6)))


def planar_margin(psi: float, offset: float) -> float:
    """Smallest eigenvalue of the symmetric part of Pi of planar analysis II [-].

    It is positive where |psi| < pi / 2 and offset^2 < 4 cos psi.

    Args:
        psi: Error of the camera's angle [rad]; 0 in analysis I.
        offset: Length of (d_1, d_2) [m]; in analysis I the error of the object's position.

    Source: servoing thesis (3.11), (3.17).
    """
    c = math.cos(psi)
    return min(c, (1.0 + c - math.hypot(1.0 - c, offset)) / 2.0)


@dataclass(frozen=True)
class PlanarVisionLimits:
    """Half sizes of boxes around zero, each for both axes, as in the thesis' combinations.

    Attributes:
        error: Of e_x, e_y [m].
        d_error: Of their errors [m].
        shift: Of the error of the camera's position on the platform [m].

    Source: servoing thesis 3.2.1, figure 3.1.
    """

    error: float
    d_error: float
    shift: float

    def largest_offset(self, psi: Array, theta_pc: float = 0.0) -> Array:
        """Largest |(d_1, d_2)| over the boxes, shape of psi [m].

        A length is convex in what it depends on linearly, so corners of the boxes decide.

        Args:
            psi: Errors of the camera's angle, shape (n,) [rad].
            theta_pc: Its true angle [rad].
        """
        psi = np.reshape(np.asarray(psi, float), (-1, 1))
        e, d, t = self.error * _CORNERS[:, :2], self.d_error * _CORNERS[:, 2:4], _CORNERS[:, 4:]
        e_hat = e + d
        c, s = np.cos(psi), np.sin(psi)
        C, S = self.shift * math.cos(theta_pc), self.shift * math.sin(theta_pc)
        d1 = e_hat[:, 1] * c - e[:, 1] + e_hat[:, 0] * s - t[:, 1] * C + t[:, 0] * S
        d2 = -e_hat[:, 0] * c + e[:, 0] + e_hat[:, 1] * s + t[:, 1] * S + t[:, 0] * C
        return np.asarray(np.sqrt(np.max(d1 * d1 + d2 * d2, axis=1)))

    def worst_margin(self, largest_psi: float, theta_pc: float = 0.0) -> float:
        """A lower bound of `planar_margin` over the boxes and all |psi| up to the largest one [-].

        The worst turn need not be the largest one, since the boxes' corners line up at psi = 0. So
        turns are looked at `TURN_STEP` apart, and what the margin may lose between them is taken
        off: its slope over psi is at most sin psi + |e_hat| / 2, and |e_hat| at most
        sqrt 2 (error + d_error).
        """
        count = 2 + math.floor(2.0 * largest_psi / TURN_STEP)
        psi = np.linspace(-largest_psi, largest_psi, count)
        c = np.cos(psi)
        offset = self.largest_offset(psi, theta_pc)
        margin = np.minimum(c, (1.0 + c - np.hypot(1.0 - c, offset)) / 2.0)
        slope = 1.0 + (self.error + self.d_error) / math.sqrt(2.0)
        return float(np.min(margin)) - slope * largest_psi / (count - 1)


def largest_object_error(theta_u: Array, theta_u_hat: Array) -> Array:
    """Length below which no error of the object's position makes spatial analysis I fail [m].

    By Schur's complement and a congruence with L_hat, Pi + Pi' > 0 for all |d_error| < d where
    d^2 = 4 min eig (L_hat' L + L' L_hat) / 2: the worst error is normal to the eigenvector. It is
    2 m where the rotations agree, as in the plane, and 0 where none is allowed.

    Args:
        theta_u: Rotation vectors of R_CdC, shape (n, 3) [rad].
        theta_u_hat: Their estimates, shape (n, 3) [rad].

    Returns:
        Shape (n,).
    """
    L = np.array([theta_u_interaction(row) for row in np.reshape(theta_u, (-1, 3))])
    L_hat = np.array([theta_u_interaction(row) for row in np.reshape(theta_u_hat, (-1, 3))])
    both = np.swapaxes(L_hat, 1, 2) @ L
    lowest = np.linalg.eigvalsh((both + np.swapaxes(both, 1, 2)) / 2.0)[:, 0]
    return np.asarray(2.0 * np.sqrt(np.maximum(lowest, 0.0)))


def seen_turned(theta_u: Array, turn: Array) -> Array:
    """Rotation vectors of exp(turn) exp(theta_u), shape (n, 3) [rad], angles in [0, pi].

    This is how an error of the object's orientation is counted in
    `stability.perturbation_bounds`.

    Args:
        theta_u: Shape (n, 3) [rad].
        turn: Shape (n, 3) [rad].
    """
    (a, p), (b, q) = _quaternions(turn), _quaternions(theta_u)
    w = a * b - np.sum(p * q, axis=1, keepdims=True)
    v = a * q + b * p + np.cross(p, q)
    v = np.where(w < 0.0, -v, v)
    norm = np.linalg.norm(v, axis=1, keepdims=True)
    angle = 2.0 * np.arctan2(norm, np.abs(w))
    return np.asarray(np.where(norm > 1e-12, angle / np.maximum(norm, 1e-12), 2.0) * v)


def _quaternions(vectors: Array) -> tuple[Array, Array]:
    vectors = np.reshape(np.asarray(vectors, float), (-1, 3))
    half = 0.5 * np.linalg.norm(vectors, axis=1, keepdims=True)
    # sinc of numpy is sin(pi x) / (pi x)
    return np.cos(half), 0.5 * np.sinc(half / np.pi) * vectors


def worst_object_error(
    largest_turn: float, turn_error: float, count: int = 9, rounds: int = 6
) -> float:
    """Smallest `largest_object_error` over all rotations up to limits [m]; 0 where one is fatal.

    What happens depends on the angle, on that of its error, and on the angle between their axes.
    They are searched on a grid that shrinks around the worst point.

    Args:
        largest_turn: Limit of the angle of theta u [rad].
        turn_error: Limit of the angle of its error, see `seen_turned` [rad].
        count: Points along each of the three axes of the grid.
        rounds: How often it shrinks, by half.
    """
    if largest_turn + turn_error >= math.pi:
        return 0.0  # theta u and its estimate can lie on opposite sides of half a turn
    lower, upper = np.zeros(3), np.array([largest_turn, turn_error, math.pi])
    low, high = lower.copy(), upper.copy()
    worst = math.inf
    for _ in range(rounds):
        axes = [np.linspace(a, b, count) for a, b in zip(low, high, strict=True)]
        theta, turn, between = (x.reshape(-1) for x in np.meshgrid(*axes, indexing="ij"))
        zero = np.zeros_like(theta)
        u = np.stack([zero, zero, theta], axis=1)
        d = np.stack([turn * np.sin(between), zero, turn * np.cos(between)], axis=1)
        limits = largest_object_error(u, seen_turned(u, d))
        at = int(np.argmin(limits))
        worst = min(worst, float(limits[at]))
        half = (high - low) / 4.0
        middle = np.array([theta[at], turn[at], between[at]])
        low, high = np.maximum(lower, middle - half), np.minimum(upper, middle + half)
    return worst
