"""Where a platform is statically stable, how stiff it is, and how slowly it vibrates.

`stiffness_at` finds tensions and stiffness at many poses, `first_frequencies` the slowest natural
frequencies there; `many_stiffnesses` is the kernel. Stiffness is about Po in W, ordered (turn,
translation).

Source: servoing thesis 1.2.4; Gazebo thesis (2.25) to (2.28).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.pulley_kernel import pulley_jacobian, pulley_line, unit_vector_derivative
from cdpr_drake.geometry.two_pulleys_kernel import add_platform_turning
from cdpr_drake.numerics.kernel_calls import over_rows
from cdpr_drake.tensions.methods import distribute_batch
from cdpr_drake.tensions.quadratic_program_kernel import FEASIBLE
from cdpr_drake.workspaces.demanded_wrenches import spatial_inertias, weight_wrenches
from cdpr_drake.workspaces.static_feasibility import StaticCase, wrench_matrices

ELASTICITY = 6
"""Column of `CableSet.packed()` with the axial stiffness [N]."""

ON_BOUND = 1e-10
"""A tension this near to its lower bound, as a share of the largest one, is on it."""


@dataclass(frozen=True, eq=False)
class StiffnessAtPoses:
    """Stiffness of a platform that is held by the tensions of least 2-norm.

    Attributes:
        K: Stiffness about Po in W in the balanced rows, symmetric part, shape (n, rows, rows);
            NaN where the platform cannot be held.
        smallest: Smallest eigenvalue, turns times `StaticCase.arm`, shape (n,) [N/m]; NaN there.
        held: Where the platform can be held, shape (n,).
    """

    K: Array
    smallest: Array
    held: np.ndarray

    @property
    def stable(self) -> np.ndarray:
        """Where it is held, W is regular and the stiffness positive definite, shape (n,)."""
        return self.held & (self.smallest > 0.0)


def stiffness_at(case: StaticCase, positions: Array, rotations: Array) -> StiffnessAtPoses:
    """Stiffness by elastic cables, their tensions and the weight at poses.

    Cables are straight and elastic; one without tension does not count.

    Args:
        case: Platform, load and tension bounds.
        positions: p_WP, shape (n, 3) [m].
        rotations: R_WP, shape (n, 3, 3).

    Raises:
        TensionProblemError: The tension bounds make no sense.

    Source: servoing thesis 1.2.4; Gazebo thesis (2.25) to (2.28).
    """
    p = np.ascontiguousarray(positions, float).reshape(-1, 3)
    R = np.ascontiguousarray(rotations, float).reshape(-1, 3, 3)
    tensions, held = held_tensions(case, p, R)
    K = np.empty((len(p), 6, 6))
    cables = case.cables.packed()
    over_rows(many_stiffnesses, len(p), None, p, R, cables, tensions, case.load(), K)
    K = 0.5 * (K + K.transpose(0, 2, 1))[:, list(case.rows)][:, :, list(case.rows)]
    K[~held] = np.nan
    scale = case.row_scale()
    smallest = np.full(len(p), np.nan)
    smallest[held] = np.linalg.eigvalsh(K[held] / scale[:, np.newaxis] / scale)[:, 0]
    return StiffnessAtPoses(K, smallest, held)


def held_tensions(case: StaticCase, positions: Array, rotations: Array) -> tuple[Array, np.ndarray]:
    """Tensions of least 2-norm, shape (n, m) [N], NaN where there are none; where there are, (n,).

    Arguments as `stiffness_at`.
    """
    rows = list(case.rows)
    W = wrench_matrices(positions, rotations, case.cables)[:, rows]
    loads = weight_wrenches(case, rotations)[:, rows]
    good = np.all(np.isfinite(W), axis=(1, 2))
    tensions = np.full((len(W), case.cables.count), np.nan)
    held = np.zeros(len(W), bool)
    tensions[good], codes = distribute_batch(W[good], loads[good], *case.bounds())
    held[good] = codes == FEASIBLE
    # A cable on its lower bound may be off it by rounding: at 1e-16 N it would count as taut.
    lower = case.bounds()[0]
    largest = np.max(tensions, axis=1, keepdims=True)
    return np.where(tensions - lower <= ON_BOUND * largest, lower, tensions), held


def first_frequencies(
    found: StiffnessAtPoses, case: StaticCase, body: tuple[float, Array, Array], rotations: Array
) -> Array:
    """Slowest natural frequencies, shape (n,) [Hz]; NaN where not held or not stable.

    Args:
        found: Stiffness there.
        case: For the balanced rows.
        body: Mass [kg], centre of mass in P, shape (3,) [m], rotational inertia about Po in P,
            shape (3, 3) [kg m^2].
        rotations: R_WP, shape (n, 3, 3).
    """
    rows = list(case.rows)
    out = np.full(len(found.held), np.nan)
    good = found.stable
    M = spatial_inertias(*body, np.asarray(rotations, float)[good])[:, rows][:, :, rows]
    factor = np.linalg.inv(np.linalg.cholesky(M))
    squares = np.linalg.eigvalsh(factor @ found.K[good] @ factor.transpose(0, 2, 1))[:, 0]
    out[good] = np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi)
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def many_stiffnesses(
    first: int, past: int, positions: Array, rotations: Array, cables: Array, tensions: Array,
    load: Array, out: Array,
) -> None:  # fmt: skip
    """Writes the stiffness about Po in W, (turn, translation), for `kernel_calls.over_rows`.

    Source: Gazebo thesis (2.25) to (2.28).

    Args:
        first: First pose.
        past: One past the last.
        positions: p_WP, shape (k, 3) [m].
        rotations: R_WP, shape (k, 3, 3).
        cables: `CableSet.packed()`, shape (m, 17).
        tensions: Shape (k, m) [N]; a cable without tension does not stretch.
        load: Centre of mass in P (3) [m], weight in W (3) [N].
        out: Shape (k, 6, 6).
    """
    m = cables.shape[0]
    J, lengths, D, SD = np.empty((m, 6)), np.empty(m), np.empty((3, 3)), np.empty((3, 3))
    S, U, c = np.zeros((3, 3)), np.zeros((3, 3)), np.empty(3)
    for pose in range(first, past):
        R, p, K = rotations[pose], positions[pose], out[pose]
        X = (
            R[0, 0], R[0, 1], R[0, 2], R[1, 0], R[1, 1], R[1, 2], R[2, 0], R[2, 1], R[2, 2],
            p[0], p[1], p[2],
        )  # fmt: skip
        pulley_jacobian(X, cables, lengths, J)
        for a in range(6):
            for b in range(6):
                K[a, b] = 0.0
        for i in range(m):
            t = tensions[pose, i]
            if t == 0.0:
                continue
            # E S / l0 with the unstrained length l0 = l / (1 + t / E S)
            pull = (cables[i, ELASTICITY] + t) / lengths[i]
            for a in range(6):
                for b in range(6):
                    K[a, b] += pull * J[i, a] * J[i, b]
            _, ux, uy, uz, rx, ry, rz = pulley_line(X, cables[i])
            unit_vector_derivative(X, cables[i], D)
            _cross_matrix(rx, ry, rz, S)
            _cross_matrix(ux, uy, uz, U)
            for a in range(3):
                for b in range(3):
                    SD[a, b] = S[a, 0] * D[0, b] + S[a, 1] * D[1, b] + S[a, 2] * D[2, b]
            for a in range(3):
                for b in range(3):
                    turn = 0.0
                    for k in range(3):
                        # S' D S + U S = -S D S + U S
                        turn += (U[a, k] - SD[a, k]) * S[k, b]
                    K[a, b] += t * turn
                    K[a, 3 + b] += t * SD[a, b]
                    K[3 + b, a] += t * SD[a, b]
                    K[3 + a, 3 + b] += t * D[a, b]
            add_platform_turning(X, cables[i], t, K)
        for a in range(3):
            c[a] = R[a, 0] * load[0] + R[a, 1] * load[1] + R[a, 2] * load[2]
        # -[f]x [c]x = (f'c) 1 - c f' with the weight f
        work = load[3] * c[0] + load[4] * c[1] + load[5] * c[2]
        for a in range(3):
            for b in range(3):
                K[a, b] -= c[a] * load[3 + b] - (work if a == b else 0.0)


@njit(cache=True, error_model="numpy")
def _cross_matrix(x: float, y: float, z: float, out: Array) -> None:
    out[0, 1], out[0, 2], out[1, 2] = -z, y, -x
    out[1, 0], out[2, 0], out[2, 1] = z, -y, x
