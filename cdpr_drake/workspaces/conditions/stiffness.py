"""Where a platform is statically stable, how stiff it is, and how slowly it vibrates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.numerics import over_rows
from cdpr_drake.tensions import FEASIBLE, distribute_batch
from cdpr_drake.workspaces.conditions.stiffness_kernel import many_stiffnesses
from cdpr_drake.workspaces.wrenches import (
    StaticCase,
    spatial_inertias,
    weight_wrenches,
    wrench_matrices,
)


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


ON_BOUND = 1e-10
"""A tension this near to its lower bound, as a share of the largest one, is on it."""


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
