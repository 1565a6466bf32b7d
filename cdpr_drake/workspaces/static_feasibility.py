"""Which poses of a platform can be held still with tensions within bounds."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.pulley_kernel import pulley_jacobian
from cdpr_drake.numerics.kernel_calls import over_rows
from cdpr_drake.workspaces.wrench_feasibility_kernel import many_static

CABLE_FREE = 1e-9
"""Shorter cables [m] have no direction: there the platform cannot be."""


@dataclass(frozen=True, eq=False)
class StaticCase:
    """A platform on cables and what it has to bear.

    Attributes:
        cables: The cables; over pulleys where they have any.
        lower: Smallest tensions, shape (m,) [N].
        upper: Largest tensions, shape (m,) [N].
        weight: Weight of the platform [N].
        p_PCo: Centre of mass in P, shape (3,) [m].
        wrench: Further wrench about Po in W, shape (6,) (moment, force) [N m, N].
        rows: Components of a spatial vector (rotation, translation) that are balanced: all six,
            or those of a planar platform.
        down: Where the weight pulls, a unit vector in W.

    Raises:
        TensionProblemError: There are fewer cables than rows, or a number makes no sense.
    """

    cables: CableSet
    lower: Array
    upper: Array
    weight: float
    p_PCo: Array
    _: KW_ONLY
    wrench: Array
    rows: tuple[int, ...]
    down: tuple[float, float, float] = (0.0, 0.0, -1.0)

    def __post_init__(self) -> None:
        """Checks the number of cables and the weight; `distribute_batch` checks the bounds."""
        m, n = self.cables.count, len(self.rows)
        if m < n:
            raise TensionProblemError(
                f"cables: found {m} for {n} degrees of freedom; accepted: at least {n}"
            )
        if not (np.isfinite(self.weight) and self.weight >= 0.0):
            raise TensionProblemError(f"weight: found {self.weight:g}; accepted: >= 0 [N]")

    def force(self) -> Array:
        """The weight as a force in W, shape (3,) [N]."""
        return self.weight * np.array(self.down)

    def load(self) -> Array:
        """Centre of mass in P [m] and weight in W [N], as the kernels take them, shape (6,)."""
        return np.concatenate([self.p_PCo, self.force()]).astype(float)

    def check_bounds(self) -> None:
        """Raises a TensionProblemError unless 0 <= lower <= upper, all finite, one a cable."""
        m = self.cables.count
        for name, value in (("lower", self.lower), ("upper", self.upper)):
            if np.shape(value) != (m,) or not np.all(np.isfinite(value)):
                raise TensionProblemError(
                    f"{name}: found shape {np.shape(value)}, or a number that is not finite; "
                    f"accepted: {m} finite tensions [N]"
                )
        if np.any(np.less(self.lower, 0.0)) or np.any(np.greater(self.lower, self.upper)):
            raise TensionProblemError(
                "lower: found a tension below 0 or above upper; accepted: 0 <= lower <= upper [N]"
            )

    def bounds(self) -> tuple[Array, Array]:
        """Smallest and largest tensions as the kernels take them, shape (m,) each [N]."""
        return np.array(self.lower, float), np.array(self.upper, float)

    def arm(self) -> float:
        """What makes moments comparable with forces: root mean square of the anchors' |p_PB| [m].

        As `slack_relaxed` has it; 1 where all anchors are in Po, which takes no moment.
        """
        return float(np.sqrt(np.mean(np.sum(self.cables.p_PB**2, axis=0)))) or 1.0

    def row_scale(self) -> Array:
        """By which the balanced rows are divided to have one unit, shape (n,) [m, -]."""
        return np.array([self.arm() if row < 3 else 1.0 for row in self.rows])


def wrench_matrices(positions: Array, rotations: Array, cables: CableSet) -> Array:
    """W of many poses, as `-geometry.cable_jacobian.T` of one, shape (n, 6, m).

    Args:
        positions: p_WP, shape (n, 3) [m].
        rotations: R_WP, shape (n, 3, 3).
        cables: The cables.

    Returns:
        Rows (moment [m], force [-]); NaN in the column of a cable without length, or that cannot
        run over its pulley.
    """
    p_PB_W = np.einsum("nij,jm->nmi", rotations, cables.p_PB)
    p_AB_W = positions[:, np.newaxis, :] + p_PB_W - cables.p_WA.T
    length = np.linalg.norm(p_AB_W, axis=-1, keepdims=True)
    u = p_AB_W / np.where(length > CABLE_FREE, length, np.nan)
    J = np.concatenate([np.cross(p_PB_W, u), u], axis=-1)
    if cables.has_pulleys():
        over = cables.pulley_radius + cables.anchor_pulley_radius + cables.arm > 0.0
        J[:, over] = _over_pulleys(positions, rotations, cables.packed()[over])
    return -J.transpose(0, 2, 1)


@njit(cache=True, error_model="numpy")
def _over_pulleys(positions: Array, rotations: Array, cables: Array) -> Array:
    """J of the poses, shape (n, m, 6); cables as `CableSet.packed`, shape (m, 17)."""
    n, m = len(positions), len(cables)
    J, lengths = np.empty((n, m, 6)), np.empty(m)
    for k in range(n):
        R, p = rotations[k], positions[k]
        X = (
            R[0, 0], R[0, 1], R[0, 2], R[1, 0], R[1, 1], R[1, 2], R[2, 0], R[2, 1], R[2, 2],
            p[0], p[1], p[2],
        )  # fmt: skip
        pulley_jacobian(X, cables, lengths, J[k])
    return J


def statically_feasible(case: StaticCase, positions: Array, rotations: Array) -> np.ndarray:
    """Whether tensions within the bounds balance weight and wrench, pose by pose, shape (n,).

    Poses at which the wrench matrix is singular count as infeasible: there the cables cannot
    resist every wrench, however small.

    Args:
        case: Platform and load.
        positions: p_WP, shape (n, 3) [m].
        rotations: R_WP, shape (n, 3, 3).

    Raises:
        TensionProblemError: The tension bounds make no sense.

    Source: servoing thesis (1.25).
    """
    case.check_bounds()
    # Copies, hence writable: kernels are compiled anew for arrays that are not.
    positions = np.array(positions, float, order="C").reshape(-1, 3)
    rotations = np.array(rotations, float, order="C").reshape(-1, 3, 3)
    out = np.empty(len(positions), bool)
    load = np.concatenate([case.load(), case.wrench]).astype(float)
    over_rows(
        many_static, len(positions), None, positions, rotations, case.cables.packed(), load,
        np.array(case.rows), *case.bounds(), case.row_scale(), out,
    )  # fmt: skip
    return out
