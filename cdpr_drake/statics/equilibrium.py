"""Where a platform comes to rest when its cables have given unstrained lengths."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.cables.models import CABLE_MODELS, ELASTIC, cable_law, check_model
from cdpr_drake.cables.states import TOO_SHORT, cable_state
from cdpr_drake.errors import EquilibriumError
from cdpr_drake.geometry.cable_paths import cable_paths, motion_of
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_type import FREE, MotionType
from cdpr_drake.geometry.poses import pose_error, pose_from_row, pose_row, rotation_from_vector
from cdpr_drake.statics.equilibrium_kernel import RESTS, SOFTENING, energy_at, settle
from cdpr_drake.statics.inextensible_equilibrium import rigid_cables_rest
from cdpr_drake.statics.rigid_platform import RigidPlatform

NEUTRAL = 1e-7
"""A stiffness below this share of the largest one, turns times an arm, counts as none."""

SAME_PLACE = 1e-5
"""Equilibria nearer than this [m, and rad] are one."""


class Stability(StrEnum):
    """What happens after a small push.

    STABLE: the platform comes back. NEUTRAL: to first order nothing holds it in some direction.
    UNSTABLE: it leaves.
    """

    STABLE = "stable"
    NEUTRAL = "neutral"
    UNSTABLE = "unstable"


@dataclass(frozen=True, kw_only=True, eq=False)
class Equilibrium:
    """A platform at rest on its cables.

    Attributes:
        X_WP: Its pose.
        tensions: At the platform, shape (m,) [N].
        slack: Cables that are, as `CableState` has it, shape (m,).
        energy: Potential energy of platform (0 at the origin of W) and cables [J].
        unbalanced: Force, or moment per arm, that is left unbalanced [N].
        stiffnesses: Principal stiffnesses with turns times the arm, least first, shape (n,) [N/m];
            infinite where inextensible cables hold.
        stability: The verdict on them.
        steps: Steps of the search.
    """

    X_WP: RigidTransform
    tensions: Array
    slack: np.typing.NDArray[np.bool_]
    energy: float
    unbalanced: float
    stiffnesses: Array
    stability: Stability
    steps: int


def anchor_arm(cables: CableSet) -> float:
    """Mean distance of the anchor points from Po [m], or 0.1 m where all are at Po."""
    return float(np.mean(np.linalg.norm(cables.p_PB, axis=0))) or 0.1


def equilibrium_near(
    cables: CableSet,
    model: str,
    platform: RigidPlatform,
    l0: Array,
    guess: RigidTransform,
    soften: bool = False,
) -> Equilibrium:
    """The pose at which the platform comes to rest when let go near a guess.

    Args:
        cables: The cables; over pulleys where their radius is positive.
        model: A name of `cables.CABLE_MODELS`.
        platform: The platform.
        l0: Unstrained lengths, shape (m,), > 0 [m].
        guess: Pose to start from; what the platform cannot move stays.
        soften: Whether to let it settle on soft cables first, which is faster and surer from far
            away, and may pass by an equilibrium near the guess.

    Raises:
        EquilibriumError: The search ends before the forces balance; says how much is missing.
        CableModelError: An unknown model, or lengths that are not positive.
    """
    check_model(model, cables)
    l0 = _checked_lengths(l0, (cables.count,))
    arm = anchor_arm(cables)
    if not CABLE_MODELS[model].extensible:
        return _inextensible(cables, platform, l0, guess, soften)
    state, solved = np.concatenate([pose_row(guess), np.zeros(6)]), np.zeros((cables.count, 2))
    rows, steps = cables.packed(), 0
    weight, law, free = platform.packed_weight(), cable_law(model, cables), platform.motion.packed()
    for softness in SOFTENING if soften else SOFTENING[-1:]:
        code, more, unbalanced = settle(state, law, rows, l0, softness, weight, free, arm, solved)
        steps += more
    if code != RESTS:
        raise EquilibriumError(
            f"equilibrium: none found from ({_words(guess.translation())}) m: after {steps} steps "
            f"{unbalanced:.3g} N are left unbalanced"
        )
    X_WP = pose_from_row(state[:7])
    g, H = np.empty(6), np.empty((6, 6))
    energy, _, _ = energy_at(law, motion_of(X_WP), rows, l0, 1.0, weight, free, solved, g, H)
    at_rest = cable_state(cables, model, X_WP, l0)
    part = platform.motion.part(H, X_WP.rotation().matrix())
    stiffnesses = principal_stiffnesses(part, platform, arm)
    return Equilibrium(
        X_WP=X_WP, tensions=at_rest.tensions, slack=at_rest.slack, energy=energy,
        unbalanced=unbalanced, stiffnesses=stiffnesses, stability=classify_equilibrium(stiffnesses),
        steps=steps,
    )  # fmt: skip


def principal_stiffnesses(K: Array, platform: RigidPlatform, arm: float) -> Array:
    """Eigenvalues of a symmetric stiffness with turns times an arm [m], shape (n,) [N/m]."""
    scale = np.ones(platform.motion.freedom)
    scale[: platform.motion.num_turns] = 1.0 / arm
    return np.asarray(np.linalg.eigvalsh(K * np.outer(scale, scale)), float)


def classify_equilibrium(stiffnesses: Array) -> Stability:
    """The verdict on principal stiffnesses, least first [N/m]."""
    finite = stiffnesses[np.isfinite(stiffnesses)]
    if len(finite) == 0:
        return Stability.STABLE
    limit = NEUTRAL * float(np.max(np.abs(finite)))
    if finite[0] > limit:
        return Stability.STABLE
    return Stability.UNSTABLE if finite[0] < -limit else Stability.NEUTRAL


def equilibria(
    cables: CableSet,
    model: str,
    platform: RigidPlatform,
    l0: Array,
    starts: Iterable[RigidTransform],
) -> list[Equilibrium]:
    """All distinct equilibria that a search from many starts finds, the lowest energy first.

    Of a family of neutral equilibria of one energy, one is returned. That there are no others is
    not proven; more starts find more.

    Arguments as in `equilibrium_near`; starts as `random_starts` makes them.

    Raises:
        EquilibriumError: No start leads to one.
        CableModelError: As there.
    """
    rests: list[Equilibrium] = []
    last: EquilibriumError | None = None
    for start in starts:
        try:
            one = equilibrium_near(cables, model, platform, l0, start, soften=True)
        except EquilibriumError as problem:
            last = problem
            continue
        if one.stability != Stability.UNSTABLE and not any(_same(one, other) for other in rests):
            rests.append(one)
    if not rests:
        raise last or EquilibriumError("equilibrium: found no starts; accepted: at least one")
    return sorted(rests, key=lambda one: one.energy)


def _same(one: Equilibrium, other: Equilibrium) -> bool:
    distance, angle = pose_error(one.X_WP, other.X_WP)
    if distance < SAME_PLACE and angle < SAME_PLACE:
        return True
    neutral = Stability.NEUTRAL in (one.stability, other.stability)
    return neutral and abs(one.energy - other.energy) <= 1e-6 * max(abs(one.energy), 1e-3)


def random_starts(
    lower: Array, upper: Array, count: int, seed: int, motion: MotionType = FREE
) -> list[RigidTransform]:
    """Poses in a box that a platform can have, of all its orientations.

    One in a horizontal plane is at `lower[2]`, turned about z; one that only some other line or
    plane of W holds has to be put there afterwards, see `PlatformJoint.nearest`.

    Args:
        lower: Lower corner for Po, shape (3,) [m].
        upper: Upper corner, shape (3,) [m].
        count: How many.
        seed: Of the random numbers.
        motion: Which motions it has.
    """
    random = np.random.default_rng(seed)
    poses = []
    for _ in range(count):
        p = random.uniform(lower, upper)
        turn = random.normal(size=3)
        turn *= random.uniform(0.0, np.pi) / np.linalg.norm(turn)
        if motion.num_turns == 1:
            turn = random.uniform(-np.pi, np.pi) * np.asarray(motion.axis)
        elif motion.is_point:
            turn = np.zeros(3)
        if motion.is_plane and motion.axis == (0.0, 0.0, 1.0):
            p[2] = lower[2]
        poses.append(RigidTransform(rotation_from_vector(turn), p))
    return poses


def _inextensible(
    cables: CableSet, platform: RigidPlatform, l0: Array, guess: RigidTransform, soften: bool
) -> Equilibrium:
    elastic = equilibrium_near(cables, ELASTIC, platform, l0, guess, soften)
    X_WP, tensions, free, unbalanced = rigid_cables_rest(
        cables, platform, l0, elastic.X_WP, anchor_arm(cables)
    )
    stiffnesses = np.concatenate([free, np.full(platform.motion.freedom - len(free), np.inf)])
    return Equilibrium(
        X_WP=X_WP,
        tensions=tensions,
        slack=l0 - cable_paths(X_WP, cables).lengths > TOO_SHORT,
        energy=platform.potential_energy(X_WP),
        unbalanced=unbalanced,
        stiffnesses=stiffnesses,
        stability=classify_equilibrium(stiffnesses),
        steps=elastic.steps,
    )


def _checked_lengths(l0: Array, shape: tuple[int, ...]) -> Array:
    l0 = np.ascontiguousarray(l0, float)
    if l0.shape != shape or not np.all(np.isfinite(l0) & (l0 > 0.0)):
        words = " x ".join(str(size) for size in shape)
        found = f"shape {l0.shape}" if l0.shape != shape else "NaN or one <= 0"
        raise EquilibriumError(f"lengths: found {found}; accepted: {words} finite numbers > 0 [m]")
    return l0


def _words(values: Array) -> str:
    return ", ".join(f"{value:.4g}" for value in values)
