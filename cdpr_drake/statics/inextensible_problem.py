"""A platform on cables of given lengths, and a pose at which it rests."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import EquilibriumError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import cross_matrix
from cdpr_drake.statics.equilibrium import Stability, anchor_arm, classify_equilibrium
from cdpr_drake.statics.inextensible_equilibrium import tension_stiffness

JUST_TAUT = 1e-7
"""A cable whose path is nearer than this [m] to its length counts as taut."""


@dataclass(frozen=True, kw_only=True, eq=False)
class HangingPlatform:
    """A platform with a weight, on cables, and the motions that it has.

    Attributes:
        cables: The cables; their pulleys are left out where a function says so.
        weight_W: Weight of the platform, shape (3,) [N].
        p_PCo: Centre of mass in P, shape (3,) [m].
        num_turns: Rotations: 3 of a body in space, 1 in a plane, 0 of a point mass.
        num_moves: Translations: 3 in space, 2 in a plane, 1 on a line.
        axis: In W, normal of the plane or direction of the line, shape (3,).
        home: A pose that it can have: fixes the plane or line, and what it cannot turn.
    """

    cables: CableSet
    weight_W: Array
    p_PCo: Array
    num_turns: int = 3
    num_moves: int = 3
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    home: RigidTransform

    def __post_init__(self) -> None:
        """Checks the motions.

        Raises:
            EquilibriumError: No platform moves so, or its weight does not load it.
        """
        if (self.num_turns, self.num_moves) not in {(3, 3), (1, 2), (0, 3), (0, 2), (0, 1)}:
            raise EquilibriumError(
                f"equilibria: found a platform with {self.num_turns} turns and {self.num_moves} "
                "translations; accepted: a body in space or in a plane, or a point mass"
            )

    @property
    def freedom(self) -> int:
        """Degrees of freedom n."""
        return self.num_turns + self.num_moves

    def moves(self) -> Array:
        """Unit vectors in W along which it moves, columns, shape (3, num_moves)."""
        if self.num_moves == 3:
            return np.eye(3)
        axis = np.asarray(self.axis, float) / np.linalg.norm(self.axis)
        if self.num_moves == 1:
            return axis[:, None]
        first = np.eye(3)[(int(np.argmax(np.abs(axis))) + 1) % 3]
        first = first - axis * (first @ axis)
        first /= np.linalg.norm(first)
        return np.column_stack([first, np.cross(axis, first)])

    def twists(self) -> Array:
        """Twists (rotation, translation) in W that it has, columns, shape (6, n)."""
        B = np.zeros((6, self.freedom))
        if self.num_turns == 3:
            B[:3, :3] = np.eye(3)
        elif self.num_turns == 1:
            B[:3, 0] = np.asarray(self.axis, float) / np.linalg.norm(self.axis)
        B[3:, self.num_turns :] = self.moves()
        return B

    def load(self) -> Array:
        """The part of the weight along which it moves, shape (3,) [N].

        Raises:
            EquilibriumError: There is none: without weight a platform on inextensible cables rests
                wherever they let it.
        """
        moves = self.moves()
        load = moves @ (moves.T @ self.weight_W)
        if not np.linalg.norm(load) > 1e-9 * max(float(np.linalg.norm(self.weight_W)), 1e-9):
            raise EquilibriumError(
                "equilibria: found no weight along the motions of the platform, so that it rests "
                "on inextensible cables wherever they let it; accepted: a weight there, or "
                "elastic cables"
            )
        return np.asarray(load, float)

    def unbalanced(self, X_WP: RigidTransform, tensions: Array) -> float:
        """Force, or moment per arm, that tensions and weight leave unbalanced [N]."""
        arm = anchor_arm(self.cables)
        wrench = self.weight_wrench(X_WP) - cable_paths(X_WP, self.cables).J.T @ tensions
        left = self.twists().T @ wrench
        left[: self.num_turns] /= arm
        return float(np.max(np.abs(left)))

    def weight_wrench(self, X_WP: RigidTransform) -> Array:
        """Weight about Po in W, shape (6,) [N m, N]."""
        arm = X_WP.rotation().matrix() @ self.p_PCo
        return np.concatenate([np.cross(arm, self.weight_W), self.weight_W])

    def weight_stiffness(self, X_WP: RigidTransform) -> Array:
        """Minus the derivative of `weight_wrench` by (turn, translation), shape (6, 6)."""
        K = np.zeros((6, 6))
        arm = X_WP.rotation().matrix() @ self.p_PCo
        K[:3, :3] = -cross_matrix(self.weight_W) @ cross_matrix(arm)
        return K

    def energy(self, X_WP: RigidTransform) -> float:
        """Potential energy of the platform, 0 with its centre of mass at Wo [J]."""
        return -float(self.weight_W @ X_WP.multiply(self.p_PCo))


class Certificate(StrEnum):
    """What stands behind a pose of rest.

    PROVEN: interval arithmetic proves that in a box about it the platform rests at one pose and no
    other, with the same cables tense and the others slack. PROVEN_TAUT: the same, but for cables
    whose path is as long as they are and that are not needed. CLOSED_FORM: it is written down.
    NUMERICAL: forces and lengths fit, and no more is known; there may be others nearby.
    """

    PROVEN = "proven"
    PROVEN_TAUT = "proven but for cables that are just taut"
    CLOSED_FORM = "closed form"
    NUMERICAL = "numerical"


@dataclass(frozen=True, kw_only=True, eq=False)
class EquilibriumPose:
    """A platform at rest on cables.

    Attributes:
        X_WP: Its pose.
        tensions: Shape (m,), 0 of cables that do not pull [N].
        slack: Cables that are longer than their path, shape (m,).
        energy: Of platform and cables [J].
        unbalanced: Force, or moment per arm, that is left unbalanced [N].
        stiffnesses: Principal stiffnesses of the motions that are left, turns times the mean arm
            of the anchor points, least first [N/m]; infinite where inextensible cables hold.
        stability: The verdict on them.
        family: Whether it is one of a continuum of poses of rest, of the same energy.
        certificate: What stands behind it.
        radius: Half the box of `PROVEN`: of Po in W and of the quaternion's components [m, -].
    """

    X_WP: RigidTransform
    tensions: Array
    slack: np.typing.NDArray[np.bool_]
    energy: float
    unbalanced: float
    stiffnesses: Array
    stability: Stability
    family: bool = False
    certificate: Certificate = Certificate.NUMERICAL
    radius: float | None = None


def make_equilibrium_pose(
    platform: HangingPlatform,
    lengths: Array,
    X_WP: RigidTransform,
    tensions: Array,
    *,
    family: bool,
    certificate: Certificate,
    radius: float | None,
) -> EquilibriumPose:
    """A pose of rest on inextensible cables, judged by the Hessian of the potential energy.

    The Hessian is that of the Lagrangian along the motions that tense cables leave to first order.
    """
    cables, twists = platform.cables, platform.twists()
    paths = cable_paths(X_WP, cables)
    arm = anchor_arm(cables)
    scale = np.ones(platform.freedom)
    scale[: platform.num_turns] = 1.0 / arm
    J = paths.J[tensions > 0.0] @ twists * scale
    K = tension_stiffness(X_WP, cables, tensions) + platform.weight_stiffness(X_WP)
    K = twists.T @ (0.5 * (K + K.T)) @ twists * np.outer(scale, scale)
    rank = int(np.linalg.matrix_rank(J, tol=1e-9)) if len(J) else 0
    left = np.linalg.svd(J)[2][rank:].T if len(J) else np.eye(platform.freedom)
    free = np.asarray(np.linalg.eigvalsh(left.T @ K @ left), float)
    # A turn that moves nothing has a stiffness of rounding errors, whatever the others have.
    size = float(np.max(np.abs(K))) + float(np.linalg.norm(platform.weight_W)) / arm
    free[np.abs(free) < 1e-9 * size] = 0.0
    return EquilibriumPose(
        X_WP=X_WP, tensions=tensions, slack=lengths - paths.lengths > JUST_TAUT,
        energy=platform.energy(X_WP), unbalanced=platform.unbalanced(X_WP, tensions),
        stiffnesses=np.concatenate([free, np.full(rank, np.inf)]),
        stability=classify_equilibrium(free), family=family, certificate=certificate, radius=radius,
    )  # fmt: skip
