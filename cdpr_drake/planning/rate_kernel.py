"""Numba kernels: rates of cable lengths, their accelerations and a stiffness, with derivatives.

With v_B the velocity of an anchor point, b its acceleration, u the cable's direction, D = du/dp_B:

    dl/dt = u' v_B,    d2l/dt2 = u' b + v_B' D v_B.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.motion_kernel import floating_motion
from cdpr_drake.geometry.pulley_kernel import pulley_line, unit_vector_derivative
from cdpr_drake.numerics.linear_algebra_kernel import smallest_eigenpair
from cdpr_drake.planning.cable_derivatives_kernel import axis, bend_gradient, cross, dot


@njit(cache=True, error_model="numpy")
def length_rates(points: Array, cables: Array, values: Array, slopes: Array) -> None:
    """Writes dl/dt of all cables.

    Args:
        points: Points of a motion, shape (N, 19).
        cables: `CableSet.packed()`, shape (m, 17).
        values: Gets the rates, shape (N, m) [m/s].
        slopes: Gets their derivatives by the seeds, shape (N, m, 18).
    """
    D = np.empty((3, 3))
    for k in range(points.shape[0]):
        point = points[k]
        X = floating_motion(point)[:12]
        w, v = (point[7], point[8], point[9]), (point[10], point[11], point[12])
        for i in range(cables.shape[0]):
            _, ux, uy, uz, rx, ry, rz = pulley_line(X, cables[i])
            unit_vector_derivative(X, cables[i], D)
            u, r = (ux, uy, uz), (rx, ry, rz)
            t = cross(w, r)
            vB = (v[0] + t[0], v[1] + t[1], v[2] + t[2])
            moment = cross(r, u)
            Dv = (dot(D[0], vB), dot(D[1], vB), dot(D[2], vB))
            values[k, i] = dot(u, vB)
            slopes[k, i] = 0.0
            # dr = turn x r: D v' (turn x r) = turn' (r x Dv), u' (w x (turn x r)).
            rDv, uw = cross(r, Dv), cross(r, cross(u, w))
            for j in range(3):
                slopes[k, i, j] = rDv[j] + uw[j]
                slopes[k, i, 3 + j] = Dv[j]
                slopes[k, i, 6 + j], slopes[k, i, 9 + j] = moment[j], u[j]


@njit(cache=True, error_model="numpy")
def length_accelerations(points: Array, cables: Array, values: Array, slopes: Array) -> None:
    """Writes d2l/dt2 of all cables; arguments as of `length_rates`, values in m/s^2."""
    D, dq = np.empty((3, 3)), np.empty(3)
    for k in range(points.shape[0]):
        point = points[k]
        X = floating_motion(point)[:12]
        w, v = (point[7], point[8], point[9]), (point[10], point[11], point[12])
        alpha, a = (point[13], point[14], point[15]), (point[16], point[17], point[18])
        for i in range(cables.shape[0]):
            _, ux, uy, uz, rx, ry, rz = pulley_line(X, cables[i])
            unit_vector_derivative(X, cables[i], D)
            u, r = (ux, uy, uz), (rx, ry, rz)
            t = cross(w, r)
            vB = (v[0] + t[0], v[1] + t[1], v[2] + t[2])
            s, y = cross(alpha, r), cross(w, t)
            b = (a[0] + s[0] + y[0], a[1] + s[1] + y[1], a[2] + s[2] + y[2])
            bend = bend_gradient(X, cables[i], vB, dq)
            values[k, i] = dot(u, b) + bend
            moment = cross(r, u)
            Dv = (
                2.0 * dot(D[0], vB), 2.0 * dot(D[1], vB), 2.0 * dot(D[2], vB),
            )  # fmt: skip
            rDv = cross(r, Dv)
            for j in range(3):
                one = axis(j)
                dr = cross(one, r)
                by_place = dot(D[j], b) + dq[j]
                Db = (dot(D[0], dr), dot(D[1], dr), dot(D[2], dr))
                dt = cross(w, dr)
                db = cross(alpha, dr)
                dy = cross(w, dt)
                slopes[k, i, j] = dot(Db, b) + dot(u, db) + dot(u, dy) + dot(dq, dr) + dot(Dv, dt)
                slopes[k, i, 3 + j] = by_place
                # w x (w x r) changes by dw x (w x r) + w x (dw x r).
                dw = cross(one, t)
                dx = cross(w, dr)
                slopes[k, i, 6 + j] = dot(u, dw) + dot(u, dx) + rDv[j]
                slopes[k, i, 9 + j] = Dv[j]
                slopes[k, i, 12 + j], slopes[k, i, 15 + j] = moment[j], u[j]


@njit(cache=True, error_model="numpy")
def least_stiffness(
    points: Array, cables: Array, basis: np.ndarray, scale: float, values: Array, slopes: Array
) -> None:
    """Writes the least eigenvalue of the elastic stiffness, turns counted as lengths.

    K = sum_i (E S / l)_i j_i j_i' with j = (r x u / scale, u), l the length from A to B.

    Args:
        points: Points of a motion, shape (N, 19).
        cables: `CableSet.packed()`, shape (m, 17).
        basis: Components of a spatial vector that the platform can move, shape (n,).
        scale: Length by which turns count as lengths [m].
        values: Gets the eigenvalues, shape (N, 1) [N/m].
        slopes: Gets their derivatives by the seeds, shape (N, 1, 18): those of the first
            eigenvector where there are several.
    """
    n, D = basis.shape[0], np.empty((3, 3))
    K, T, C, x = np.empty((n, n)), np.zeros((n, n)), np.zeros((n, n)), np.empty(n)
    J = np.empty((cables.shape[0], 6))
    for k in range(points.shape[0]):
        X = floating_motion(points[k])[:12]
        K[:] = 0.0
        for i in range(cables.shape[0]):
            length, ux, uy, uz, rx, ry, rz = pulley_line(X, cables[i])
            moment = cross((rx, ry, rz), (ux, uy, uz))
            for j in range(3):
                J[i, j] = moment[j] / scale
            J[i, 3], J[i, 4], J[i, 5] = ux, uy, uz
            stiff = cables[i, 6] / length
            for p in range(n):
                for q in range(n):
                    K[p, q] += stiff * J[i, basis[p]] * J[i, basis[q]]
        values[k, 0] = smallest_eigenpair(K, T, C, x)
        slopes[k] = 0.0
        turn, move = np.zeros(3), np.zeros(3)
        for p in range(n):
            if basis[p] < 3:
                turn[basis[p]] = x[p] / scale
            else:
                move[basis[p] - 3] = x[p]
        for i in range(cables.shape[0]):
            length, ux, uy, uz, rx, ry, rz = pulley_line(X, cables[i])
            unit_vector_derivative(X, cables[i], D)
            u, r = (ux, uy, uz), (rx, ry, rz)
            t = cross(turn, r)
            m = (move[0] + t[0], move[1] + t[1], move[2] + t[2])
            stretch, stiff = dot(u, m), cables[i, 6] / length
            Dm = (dot(D[0], m), dot(D[1], m), dot(D[2], m))
            # j' x = u' (move + turn x r), whose derivative is as that of a rate.
            by_turn, by_arm, moment = cross(r, Dm), cross(r, cross(u, turn)), cross(r, u)
            for j in range(3):
                slopes[k, 0, j] += (
                    2.0 * stiff * stretch * (by_turn[j] + by_arm[j])
                    - stiff / length * stretch * stretch * moment[j]
                )
                slopes[k, 0, 3 + j] += (
                    2.0 * stiff * stretch * Dm[j] - stiff / length * stretch * stretch * u[j]
                )
