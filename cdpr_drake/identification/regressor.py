"""Inverse dynamics of a rigid platform, linear in ten inertial parameters."""

from __future__ import annotations

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import cross_matrix

MASS, MOMENT, INERTIA = 0, slice(1, 4), slice(4, 10)
"""Where the vector of ten has mass [kg], mass times p_PPcm [kg m], and moments (xx, yy, zz) and
products (xy, xz, yz) of inertia about Po in P [kg m^2]."""

SIZE = 10

STEP = 1e-4
"""Of central differences [rad, rad/s, rad/s^2, m/s^2]; the regressor is a polynomial of degree two
in velocities and accelerations."""


def inertia_regressor(R_WP: Array, V_WP: Array, A_WP: Array, gravity: Array) -> Array:
    """Y with F_P_W = Y pi, the wrench about Po that a motion asks for beside the weight.

    In the axes of P, with b = a - g, h = m c, and I about Po:

        moment = I alpha + w x I w + h x b,    force = m b + alpha x h + w x (w x h).

    Args:
        R_WP: Rotations of the platform, shape (n, 3, 3).
        V_WP: Spatial velocities (w, v) in W, v that of Po, shape (n, 6) [rad/s, m/s].
        A_WP: Spatial accelerations (alpha, a) in W, a that of Po, shape (n, 6) [rad/s^2, m/s^2].
        gravity: Acceleration of a falling body in W, shape (3,) [m/s^2].

    Returns:
        Shape (n, 6, 10), rows (moment, force) in W, columns as `MASS`, `MOMENT`, `INERTIA` say.

    Source: Atkeson, An, Hollerbach, Estimation of inertial parameters of manipulator loads and
    links, 1986.
    """
    turned = np.swapaxes(R_WP, 1, 2)

    def in_P(x: Array) -> Array:
        return np.einsum("nij,nj->ni", turned, x)

    w, alpha = in_P(V_WP[:, :3]), in_P(A_WP[:, :3])
    b = in_P(A_WP[:, 3:] - gravity)
    W, turning = _cross(w), _cross(alpha)
    Y = np.zeros((len(R_WP), 6, SIZE))
    Y[:, :3, MOMENT] = -_cross(b)
    Y[:, :3, INERTIA] = _inertia_times(alpha) + W @ _inertia_times(w)
    Y[:, 3:, MASS] = b
    Y[:, 3:, MOMENT] = turning + W @ W
    Y[:, :3] = R_WP @ Y[:, :3]
    Y[:, 3:] = R_WP @ Y[:, 3:]
    return Y


def regressor_slopes(R_WP: Array, V_WP: Array, A_WP: Array, gravity: Array) -> Array:
    """How the regressor changes with the motion: with e(t), d(t) in exp([e]) R and p + d.

    To first order w grows by e' + e x w, alpha by e'' + e' x w + e x alpha, a by d''. Arguments are
    those of `inertia_regressor`.

    Returns:
        Shape (n, 6, 10, 3, 6): by (e, d), by (e', d') and by (e'', d'') about and along axes of W.
    """
    slopes = np.zeros((len(R_WP), 6, SIZE, 3, 6))
    w, alpha = V_WP[:, :3], A_WP[:, :3]
    for q in range(6):
        turn, x = q < 3, np.eye(6)[q, :3] + np.eye(6)[q, 3:]
        for order in range(3):
            if not turn and order < 2:
                continue  # neither where Po is nor how fast
            ends = []
            for h in (STEP, -STEP):
                R, V, A = R_WP, V_WP.copy(), A_WP.copy()
                if order == 0:
                    R = (np.eye(3) + h * cross_matrix(x)) @ R_WP
                    V[:, :3] += h * np.cross(x, w)
                    A[:, :3] += h * np.cross(x, alpha)
                elif order == 1:
                    V[:, :3] += h * x
                    A[:, :3] += h * np.cross(x, w)
                else:
                    A[:, slice(3) if turn else slice(3, 6)] += h * x
                ends.append(inertia_regressor(R, V, A, gravity))
            slopes[:, :, :, order, q] = (ends[0] - ends[1]) / (2.0 * STEP)
    return slopes


def _cross(x: Array) -> Array:
    """Matrices [x] of cross products, shape (n, 3, 3)."""
    X = np.zeros((len(x), 3, 3))
    X[:, 0, 1], X[:, 0, 2], X[:, 1, 2] = -x[:, 2], x[:, 1], -x[:, 0]
    return X - np.swapaxes(X, 1, 2)


def _inertia_times(x: Array) -> Array:
    """L with I x = L (xx, yy, zz, xy, xz, yz), shape (n, 3, 6)."""
    L = np.zeros((len(x), 3, 6))
    L[:, 0, 0] = L[:, 1, 3] = L[:, 2, 4] = x[:, 0]
    L[:, 1, 1] = L[:, 0, 3] = L[:, 2, 5] = x[:, 1]
    L[:, 2, 2] = L[:, 0, 4] = L[:, 1, 5] = x[:, 2]
    return L


def symmetric(six: Array) -> Array:
    """Matrix of moments (xx, yy, zz) and products (xy, xz, yz), shape (3, 3)."""
    xx, yy, zz, xy, xz, yz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def six_of(I: Array) -> Array:  # noqa: E741
    """Inverse of `symmetric`, shape (6,)."""
    return np.array([I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]])


def about_center(mass: float, c: Array) -> Array:
    """What a mass [kg] at c [m] has of inertia about the origin, as six numbers [kg m^2]."""
    X = cross_matrix(np.asarray(c))
    return six_of(-mass * (X @ X))


def inertial_parameters(mass: float, p_PPcm: Array, I_PPcm: Array) -> Array:
    """The vector of ten.

    Args:
        mass: [kg].
        p_PPcm: Centre of mass, shape (3,) [m].
        I_PPcm: Moments (xx, yy, zz) and products (xy, xz, yz) of inertia about it in P, shape (6,)
            [kg m^2].
    """
    p = np.asarray(p_PPcm, float)
    return np.concatenate([[mass], mass * p, np.asarray(I_PPcm, float) + about_center(mass, p)])


def central_parameters(pi: Array) -> tuple[float, Array, Array]:
    """Inverse of `inertial_parameters`: mass, centre of mass and inertia about it."""
    mass = pi[MASS]
    p = pi[MOMENT] / mass
    return mass, p, pi[INERTIA] - about_center(mass, p)


def pseudo_inertia(pi: Array) -> Array:
    """The matrix that is positive definite where some body has these parameters, shape (4, 4).

    [[Sigma, h], [h', m]] with Sigma = trace(I) / 2 - I, the second moments of its mass.

    Source: Wensing, Kim, Slotine, Linear matrix inequalities for physically consistent inertial
    parameter identification, 2018.
    """
    I_o, h = symmetric(pi[INERTIA]), pi[MOMENT]
    J = np.empty((4, 4), dtype=np.asarray(pi).dtype)
    J[:3, :3] = 0.5 * np.trace(I_o) * np.eye(3) - I_o
    J[:3, 3] = J[3, :3] = h
    J[3, 3] = pi[MASS]
    return J
