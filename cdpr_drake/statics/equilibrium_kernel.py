"""Numba kernels that let a platform hang: from a guess down to a pose of least potential energy.

Newton's method on the energy of the cables and the platform's weight, with the exact Hessian; where
that is not positive definite, or a step leads up, a multiple of a metric is added until it leads
down. What it ends at has no lower pose nearby, to second order. Poses as in `pose_fit_kernel`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.cables.dispatch_kernel import cable_energy, cable_response
from cdpr_drake.cables.hanging_kernel import SENSITIVITIES
from cdpr_drake.cables.response_kernel import DERIVATIVES
from cdpr_drake.geometry.motion_kernel import Motion, floating_motion
from cdpr_drake.geometry.motion_type import keep_free
from cdpr_drake.geometry.rotation_kernel import solve_damped, turn_pose
from cdpr_drake.geometry.two_pulleys_kernel import ANCHOR_RADIUS, add_platform_turning

RESTS, STUCK = 1, 0
"""What `settle` returns: all forces balance, or the search got stuck before."""

MAX_STEPS = 2000
"""Newton steps of one search."""

SETTLED_UNBALANCE = 1e-10
"""Unbalanced force, and moment per arm, relative to weight and tensions, at which to stop."""

ACCEPTED_UNBALANCE = 1e-8
"""The same that is accepted where no step makes it smaller: round-off, and what a vertical sagging
cable does not know of its horizontal force."""

LARGEST_TURN = 0.3
"""Most that one step may turn the platform [rad]."""

LARGEST_MOVE = 0.3
"""Most that one step may move it, relative to the mean unstrained length."""

SOFTENING = (1e-3, 1e-2, 1e-1, 1.0)
"""Shares of E S with which one after the other a platform that is far from rest settles."""


@njit(cache=True, error_model="numpy")
def _add_force(r: Any, f: Any, D: Array, g: Array, H: Array) -> None:
    """Adds an energy with gradient f and Hessian D by p_WB to those by (turn, translation)."""
    dot = r[0] * f[0] + r[1] * f[1] + r[2] * f[2]
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        g[i] += r[a] * f[b] - r[b] * f[a]
        g[3 + i] += f[i]
        for j in range(3):
            c, d = (j + 1) % 3, (j + 2) % 3
            H[3 + i, 3 + j] += D[i, j]
            H[i, 3 + j] += r[a] * D[b, j] - r[b] * D[a, j]
            H[3 + i, j] += r[c] * D[i, d] - r[d] * D[i, c]
            H[i, j] += r[a] * (r[c] * D[b, d] - r[d] * D[b, c]) - r[b] * (
                r[c] * D[a, d] - r[d] * D[a, c]
            )
            H[i, j] += 0.5 * (r[i] * f[j] + f[i] * r[j])
        H[i, i] -= dot


@njit(cache=True, error_model="numpy")
def energy_at(
    law: int,
    X: Motion,
    cables: Array,
    l0: Array,
    softness: float,
    platform: Array,
    free: Array,
    solved: Array,
    g: Array,
    H: Array,
) -> Any:
    """Potential energy of platform and cables, its gradient and Hessian by (turn, translation).

    The Hessian is that along turns exp(w) R, symmetric; where forces balance it is the stiffness.

    Args:
        law: Number of the cables' law, see `CableModel`.
        X: Pose of the platform, see `pulley_kernel.pulley_plane`.
        cables: `CableSet.packed()`, shape (m, 17).
        l0: Unstrained lengths, shape (m,) [m].
        softness: Share of E S that the cables have.
        platform: Force in W that bears the weight (3) [N], centre of mass in P (3) [m].
        free: `MotionType.packed()`: which motions the platform has.
        solved: (H, V_A) of sagging cables, shape (m, 2): guess, then solution [N].
        g: Gradient, written here, shape (6,) [N m, N].
        H: Hessian, written here, shape (6, 6).

    Returns:
        (energy [J], sum of tensions [N], good); not good where a cable cannot run so.
    """
    g[:] = 0.0
    H[:] = 0.0
    D, cable = np.zeros((DERIVATIVES, 4)), np.empty(cables.shape[1])
    inner, turning = np.empty((SENSITIVITIES, 3)), np.empty((6, 6))
    cx, cy, cz = platform[3], platform[4], platform[5]
    c = (
        X[0] * cx + X[1] * cy + X[2] * cz,
        X[3] * cx + X[4] * cy + X[5] * cz,
        X[6] * cx + X[7] * cy + X[8] * cz,
    )
    up = (platform[0], platform[1], platform[2])
    _add_force(c, up, D, g, H)
    energy = up[0] * (X[9] + c[0]) + up[1] * (X[10] + c[1]) + up[2] * (X[11] + c[2])
    pull = 0.0
    for i in range(cables.shape[0]):
        cable[:] = cables[i]
        cable[6] *= softness
        px, py, pz, t, _, _, _, _, rx, ry, rz, good = cable_response(
            law, X, cable, l0[i], solved[i], inner, D
        )
        if not good:
            return np.inf, 0.0, False
        pull += t
        energy += cable_energy(law, X, cable, l0[i], solved[i])
        _add_force((rx, ry, rz), (px, py, pz), D, g, H)
        if cable[ANCHOR_RADIUS] > 0.0:
            turning[:] = 0.0
            add_platform_turning(X, cable, t, turning)
            for j in range(6):
                for k in range(6):
                    H[j, k] += 0.5 * (turning[j, k] + turning[k, j])
    keep_free(free, X, g, H)
    return energy, pull, True


@njit(cache=True, error_model="numpy")
def _unbalanced(g: Array, arm: float) -> float:
    """Force, or moment per arm, that is not balanced [N]."""
    return max(
        np.sqrt(g[3] * g[3] + g[4] * g[4] + g[5] * g[5]),
        np.sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]) / arm,
    )


@njit(cache=True, error_model="numpy")
def settle(
    state: Array,
    law: int,
    cables: Array,
    l0: Array,
    softness: float,
    platform: Array,
    free: Array,
    arm: float,
    solved: Array,
) -> Any:
    """Moves `state`, shape (13,), to rest; arguments as `energy_at`.

    Args:
        arm: Length that makes turns comparable with translations [m].

    Returns:
        Code (`RESTS`, `STUCK`), number of steps, unbalanced force or moment per arm [N].
    """
    H, A, C = np.empty((6, 6)), np.empty((6, 6)), np.empty((6, 6))
    g, trial_g, x, trial_H = np.empty(6), np.empty(6), np.empty(6), np.empty((6, 6))
    trial = state.copy()
    largest_move = LARGEST_MOVE * np.mean(l0)
    weight = np.sqrt(platform[0] ** 2 + platform[1] ** 2 + platform[2] ** 2)
    energy, pull, good = energy_at(
        law, floating_motion(state)[:12], cables, l0, softness, platform, free, solved, g, H
    )
    if not good:
        return STUCK, 0, np.inf
    rest = _unbalanced(g, arm)
    shift = 0.0
    for step in range(1, MAX_STEPS + 1):
        if rest <= SETTLED_UNBALANCE * (weight + pull):
            return RESTS, step, rest
        scale = 0.0
        for j in range(3, 6):
            scale = max(scale, abs(H[j, j]))
        scale = max(scale, (weight + pull) / largest_move)
        while True:
            A[:] = H
            for j in range(6):
                A[j, j] += shift * scale * (arm * arm if j < 3 else 1.0)
            if solve_damped(A, g, 0.0, C, x) > 0.0:
                turn = np.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
                move = np.sqrt(x[3] * x[3] + x[4] * x[4] + x[5] * x[5])
                if turn <= LARGEST_TURN and move <= largest_move:
                    break
            shift = max(3.0 * shift, 1e-9)
            if shift > 1e12:
                return STUCK, step, rest
        trial[:] = state
        turn_pose(trial, x[0], x[1], x[2])
        trial[4] += x[3]
        trial[5] += x[4]
        trial[6] += x[5]
        new, new_pull, good = energy_at(
            law, floating_motion(trial)[:12], cables, l0, softness, platform, free, solved,
            trial_g, trial_H,
        )  # fmt: skip
        new_rest = _unbalanced(trial_g, arm)
        expected = 0.0
        for j in range(6):
            expected += g[j] * x[j]
        # Energies cannot tell the last steps apart, forces can.
        equal = good and abs(expected) < 1e-13 * abs(energy) and new_rest < rest
        if good and (new < energy + 1e-4 * expected or equal):
            state[:] = trial
            energy, pull, rest = new, new_pull, new_rest
            g[:] = trial_g
            H[:] = trial_H
            shift = 0.1 * shift if shift > 1e-10 else 0.0
        else:
            shift = max(10.0 * shift, 1e-9)
            if shift > 1.0 and rest <= ACCEPTED_UNBALANCE * (weight + pull):
                return RESTS, step, rest
            if shift > 1e12:
                return STUCK, step, rest
    return RESTS if rest <= ACCEPTED_UNBALANCE * (weight + pull) else STUCK, MAX_STEPS, rest
