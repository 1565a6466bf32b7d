"""Poses of rest on straight cables, searched from random poses until few can be missing.

A search is Levenberg and Marquardt's for pose and tensions of cables that are taut at random; it
ends at poses of rest of all kinds. When to stop follows from how often each was found: with W
different ones in N searches, a Bayesian with no prior knowledge expects W (N - 1) / (N - W - 2) in
all, and that those found take the share (N - W - 1) (N + W) / (N (N - 1)) of all starts.

Source: Boender and Rinnooy Kan, Bayesian stopping rules for multistart global optimization methods,
Mathematical Programming 37, 1987.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError, EquilibriumError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_error, rotation_from_vector
from cdpr_drake.statics.equilibrium import anchor_arm, classify_equilibrium
from cdpr_drake.statics.equilibrium_enumeration import SAME_PLACE, TENSE, checked_lengths
from cdpr_drake.statics.inextensible_equilibrium import tension_stiffness
from cdpr_drake.statics.inextensible_problem import (
    JUST_TAUT,
    Certificate,
    EquilibriumPose,
    HangingPlatform,
    make_equilibrium_pose,
)

COVERED = 0.995
"""Share of all starts that should lead to what was found before a search ends."""

STEPS = 100
"""Of one search with one set of taut cables."""

CHANGES = 5
"""Sets of taut cables that one search may try, each following from the one before."""

WITHOUT_WEIGHT = 1e-3
"""Strain whose force measures tensions where there is no weight."""

LARGEST_STEP = 0.3
"""Of one step of a search, turns [rad] and moves per mean length."""

BALANCED = 1e-10
"""Residuals relative to weight and lengths, and to tensions, at which a search ends."""


@dataclass(frozen=True, eq=False)
class SampledEquilibria:
    """Poses of rest that searches found, the lowest energy first, and what may be missing.

    Attributes:
        rests: The poses; certificate numerical.
        searches: Searches that were made.
        ended: Those that ended at a pose of rest.
        expected: Poses of rest to be expected in all, those found included.
        covered: Share of starts that is expected to lead to one of those found.
        stopped: Whether the stopping rule ended the search, not the number of searches.
    """

    rests: list[EquilibriumPose]
    searches: int
    ended: int
    expected: float
    covered: float
    stopped: bool


def sample_equilibria(
    platform: HangingPlatform,
    l0: Array,
    *,
    elastic: bool = True,
    most: int = 1000,
    seed: int = 0,
    starts: list[RigidTransform] | None = None,
    report: Callable[[int, int], object] | None = None,
) -> SampledEquilibria:
    """Poses of rest on straight elastic cables, over pulleys where they have some.

    Args:
        platform: The platform.
        l0: Unstrained lengths, shape (m,), > 0 [m].
        elastic: Whether the cables give by their E S, or not at all.
        most: Searches after which to stop in any case.
        seed: Of the random poses.
        starts: Poses to begin with beside random ones; they do not count for the estimate.
        report: Called with searches made and the most.

    Raises:
        EquilibriumError: Numbers that are not accepted, or no search found a pose of rest.
    """
    l0, random = checked_lengths(platform, l0), np.random.default_rng(seed)
    found, ended = list[EquilibriumPose](), 0
    give = 1.0 / platform.cables.stiffness * elastic
    for start in starts or []:
        reached = cable_paths(start, platform.cables).lengths >= l0 - JUST_TAUT
        if not np.any(reached):  # all hang loose: the platform is below, on any of them
            reached[:] = True
        one = _search(platform, l0, start, reached, give)
        if one is not None and not _known(one, found):
            found.append(one)
    hits = set[int]()
    stopped, searches, covered, expected = False, 0, 0.0, np.inf
    while searches < most and not stopped:
        if report is not None:
            report(searches, most)
        pose, taut = _random_pose(platform, l0, random), _random_set(platform, elastic, random)
        one = _search(platform, l0, pose, taut, give)
        searches += 1
        if one is None:
            continue
        ended += 1
        index = next((i for i, other in enumerate(found) if _same(one, other)), len(found))
        if index == len(found):
            found.append(one)
        hits.add(index)
        N, W = ended, len(hits)
        if N > W + 2:
            expected = W * (N - 1) / (N - W - 2)
            covered = (N - W - 1) * (N + W) / (N * (N - 1))
            stopped = expected < W + 0.5 and covered >= COVERED
    if not found:
        raise EquilibriumError(
            f"equilibria: none found in {searches} searches; accepted: lengths that some pose has"
        )
    ordered = sorted(found, key=lambda one: one.energy)
    return SampledEquilibria(ordered, searches, ended, float(expected), float(covered), stopped)


def _known(one: EquilibriumPose, found: list[EquilibriumPose]) -> bool:
    return any(_same(one, other) for other in found)


def _same(one: EquilibriumPose, other: EquilibriumPose) -> bool:
    distance, angle = pose_error(one.X_WP, other.X_WP)
    if distance < SAME_PLACE and angle < SAME_PLACE:
        return True
    size = max(abs(one.energy), abs(other.energy), 1e-3)
    return one.family and other.family and abs(one.energy - other.energy) < 1e-6 * size


def _random_set(
    platform: HangingPlatform, elastic: bool, random: np.random.Generator
) -> np.ndarray:
    """Some cables: their number is anything that can be taut, each as likely as the others."""
    m = platform.cables.count
    most = m if elastic else min(m, platform.freedom)
    taut = np.zeros(m, bool)
    taut[random.permutation(m)[: random.integers(1, most + 1)]] = True
    return taut


def _random_pose(
    platform: HangingPlatform, l0: Array, random: np.random.Generator
) -> RigidTransform:
    """A pose in the box that all cables reach, and turned anyhow."""
    cables, home, moves = platform.cables, platform.home, platform.moves()
    reach = l0 + np.linalg.norm(cables.p_PB, axis=0)
    low, high = np.max(cables.p_WA - reach, axis=1), np.min(cables.p_WA + reach, axis=1)
    p = random.uniform(np.minimum(low, high), np.maximum(low, high))
    p = home.translation() + moves @ (moves.T @ (p - home.translation()))
    if platform.num_turns == 3:
        turn = random.normal(size=4)
        vector = 2.0 * np.arctan2(np.linalg.norm(turn[1:]), turn[0]) * turn[1:]
        vector /= np.linalg.norm(turn[1:])
    elif platform.num_turns == 1:
        vector = platform.twists()[:3, 0] * random.uniform(-np.pi, np.pi)
    else:
        vector = np.zeros(3)
    return RigidTransform(rotation_from_vector(vector) @ home.rotation(), p)


def _search(
    platform: HangingPlatform,
    l0: Array,
    start: RigidTransform,
    taut: np.ndarray,
    compliance: Array,
) -> EquilibriumPose | None:
    """A search from a pose with some cables taut; others take over where tensions or paths say so.

    None where it does not end at a pose of rest.
    """
    X, m = start, platform.cables.count
    for _ in range(CHANGES):
        found = _solve(platform, l0, X, np.flatnonzero(taut), compliance)
        if found is None:
            return None
        X, some, force = found
        tensions = np.zeros(m)
        tensions[taut] = some * force
        surplus = l0 - cable_paths(X, platform.cables).lengths
        changed = np.where(taut, tensions > TENSE * force, surplus < -JUST_TAUT)
        if np.array_equal(changed, taut):
            return _rest(platform, X, tensions, surplus, compliance)
        taut = changed
        if not np.any(taut):
            return None
    return None


def _solve(
    platform: HangingPlatform,
    l0: Array,
    X: RigidTransform,
    taut: np.ndarray,
    compliance: Array,
) -> tuple[RigidTransform, Array, float] | None:
    """Pose and tensions [force] that balance with these cables taut, by Levenberg and Marquardt.

    Unknown are both, so that stiff cables make no worse a search than inextensible ones.
    """
    cables, twists, k = platform.cables, platform.twists(), len(taut)
    arm, size = anchor_arm(cables), float(np.mean(l0))
    n, force = platform.freedom, float(np.linalg.norm(platform.moves().T @ platform.weight_W))
    if force <= 0.0:
        force = WITHOUT_WEIGHT * float(np.mean(cables.stiffness))
    scale = np.ones(n)
    scale[: platform.num_turns] = 1.0 / arm
    scaled, give = twists * scale, compliance[taut] * l0[taut] * force / size
    everything = np.zeros(cables.count)

    def state(X_WP: RigidTransform, t: Array) -> tuple[Array, Array]:
        """Residuals, of force and of mean length, and their Jacobian."""
        paths = cable_paths(X_WP, cables)
        everything[:] = 0.0
        everything[taut] = t * force
        J = paths.J[taut] @ scaled
        K = tension_stiffness(X_WP, cables, everything) + platform.weight_stiffness(X_WP)
        r = np.empty(n + k)
        r[:n] = J.T @ t - scaled.T @ platform.weight_wrench(X_WP) / force
        r[n:] = (paths.lengths[taut] - l0[taut]) / size - give * t
        A = np.zeros((n + k, n + k))
        A[:n, :n] = scaled.T @ K @ scaled / force * size
        A[:n, n:], A[n:, :n], A[n:, n:] = J.T, J, -np.diag(give)
        return r, A

    try:
        paths = cable_paths(X, cables)
        pull = scaled.T @ platform.weight_wrench(X) / force
        t = np.abs(np.linalg.lstsq((paths.J[taut] @ scaled).T, pull, rcond=1e-6)[0])
        r, A = state(X, t)
        damping = 1e-2
        for _ in range(STEPS):
            if np.max(np.abs(r)) <= BALANCED * (1.0 + np.max(t)):
                return X, t, force
            normal = A.T @ A
            step = -np.linalg.solve(normal + damping * np.eye(n + k), A.T @ r)
            moved = scaled @ step[:n] * size
            turn, move = float(np.linalg.norm(moved[:3])), float(np.linalg.norm(moved[3:]))
            step *= min(1.0, LARGEST_STEP / max(turn, 1e-9), LARGEST_STEP * size / max(move, 1e-9))
            moved = scaled @ step[:n] * size
            trial = RigidTransform(
                rotation_from_vector(moved[:3]) @ X.rotation(), X.translation() + moved[3:]
            )
            new, slope = state(trial, t + step[n:])
            if np.linalg.norm(new) < np.linalg.norm(r):
                X, t, r, A, damping = trial, t + step[n:], new, slope, 0.1 * damping
            else:
                damping = max(10.0 * damping, 1e-12)
                if damping > 1e6:
                    return None
    except (CableGeometryError, np.linalg.LinAlgError):
        return None
    return None


def _rest(
    platform: HangingPlatform, X_WP: RigidTransform, tensions: Array, surplus: Array, give: Array
) -> EquilibriumPose:
    if not np.any(give):
        rest = make_equilibrium_pose(
            platform, surplus + cable_paths(X_WP, platform.cables).lengths, X_WP, tensions,
            family=False, certificate=Certificate.NUMERICAL, radius=None,
        )  # fmt: skip
        return replace(rest, family=bool(np.any(rest.stiffnesses == 0.0)))
    arm, twists = anchor_arm(platform.cables), platform.twists()
    scale = np.ones(platform.freedom)
    scale[: platform.num_turns] = 1.0 / arm
    paths, taut = cable_paths(X_WP, platform.cables), tensions > 0.0
    J = paths.J[taut] @ twists * scale
    lengths = (paths.lengths + surplus)[taut]
    stretched = tensions[taut] * give[taut] * lengths
    K = tension_stiffness(X_WP, platform.cables, tensions) + platform.weight_stiffness(X_WP)
    H = twists.T @ K @ twists * np.outer(scale, scale)
    H = 0.5 * (H + H.T) + (J.T / (give[taut] * lengths)) @ J
    tangent = np.asarray(np.linalg.eigvalsh(H), float)
    # Turns that move nothing have stiffnesses of rounding errors of the tensions alone.
    tangent[np.abs(tangent) < 1e-12 * float(np.max(np.abs(H)))] = 0.0
    return EquilibriumPose(
        X_WP=X_WP, tensions=tensions, slack=~taut,
        energy=platform.energy(X_WP) + 0.5 * float(np.sum(stretched * tensions[taut])),
        unbalanced=platform.unbalanced(X_WP, tensions), stiffnesses=tangent,
        stability=classify_equilibrium(tangent), family=bool(np.any(tangent == 0.0)),
    )  # fmt: skip
