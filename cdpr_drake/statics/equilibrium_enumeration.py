"""All poses at which a platform rests on inextensible cables of given lengths.

`enumerate_equilibria` asks every set of cables that may be taut. Where turns lead from one pose of
rest to others, `member_within_reach` finds one of that family that lets the slack cables be slack.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.errors import EquilibriumError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_error, rotation_from_vector
from cdpr_drake.statics.equilibrium import Stability
from cdpr_drake.statics.equilibrium_certificate import ProvenBox, prove_rest
from cdpr_drake.statics.inextensible_problem import (
    JUST_TAUT,
    Certificate,
    EquilibriumPose,
    HangingPlatform,
    make_equilibrium_pose,
)
from cdpr_drake.statics.real_solutions import PathCount
from cdpr_drake.statics.start_systems import KINDS
from cdpr_drake.statics.taut_equilibria import (
    Body,
    TautRest,
    hanging_points,
    hangs_from_a_point,
    rests_from_a_point,
    rests_in_plane,
    rests_in_space,
    rests_on_two,
)

MOST_CABLES = 8
"""Of a platform that is accepted."""

TENSE = 1e-9
"""A tension below this share of the weight is none: the set of cables without it has the pose."""

SAME_PLACE = 1e-6
"""Poses nearer than this [m, and rad] are one."""

BALANCED = 1e-6
"""Unbalanced force relative to the weight up to which a solution is one of the robot, too."""

ANY_TURNS = 500
"""Orientations that are tried where a platform turns anyhow about its centre of mass."""


@dataclass(frozen=True, eq=False)
class EquilibriumSet:
    """All poses of rest that were found, the lowest energy first, and how sure it is.

    Attributes:
        rests: The poses of rest.
        paths: How the paths to all complex solutions ended. Where none was lost, and none ended
            at a singular solution, no isolated pose of rest is missing, with probability one.
        sets: Sets of taut cables that were asked.
    """

    rests: list[EquilibriumPose]
    paths: PathCount
    sets: int

    @property
    def complete(self) -> bool:
        """Whether all isolated poses were found, with probability one."""
        return self.paths.lost == 0


def enumerate_equilibria(
    platform: HangingPlatform,
    lengths: Array,
    report: Callable[[int, int], object] | None = None,
) -> EquilibriumSet:
    """All poses of rest, stable or not, with any cables slack.

    Every set of at most n cables is asked for the poses that it holds while taut; kept are those
    at which its tensions are positive and no other cable is too short. Cables leave from their
    exit points: pulleys are left out.

    Args:
        platform: The platform; 1 to 8 cables.
        lengths: Lengths of the cables, shape (m,), > 0 [m].
        report: Called with sets done and sets in all.

    Raises:
        EquilibriumError: Numbers that are not accepted; or no pose has these lengths: says which
            cable is too short, or that there is none.
    """
    platform = replace(platform, cables=platform.cables.without_pulleys())
    lengths = checked_lengths(platform, lengths)
    platform.load()
    m, n = platform.cables.count, platform.freedom
    sets = [list(s) for k in range(1, min(m, n) + 1) for s in combinations(range(m), k)]
    count, rests = PathCount(), list[EquilibriumPose]()
    for done, taut in enumerate(sets):
        if report is not None:
            report(done, len(sets))
        if not _within_reach(platform, lengths, taut):
            continue
        found, more = _on_taut(platform, lengths, taut)
        count.add(more)
        rests += _kept(platform, lengths, taut, found)
    if report is not None:
        report(len(sets), len(sets))
    rests = _distinct(rests)
    if not rests:
        raise EquilibriumError(_why_none(platform, lengths))
    return EquilibriumSet(sorted(rests, key=lambda one: one.energy), count, len(sets))


def is_stable(one: EquilibriumPose) -> bool:
    """Whether a small push is forgiven."""
    return one.stability == Stability.STABLE


def checked_lengths(platform: HangingPlatform, lengths: Array) -> Array:
    """The lengths as an array.

    Raises:
        EquilibriumError: Too many cables, or numbers that are no lengths.
    """
    m = platform.cables.count
    if m > MOST_CABLES:
        raise EquilibriumError(f"equilibria: found {m} cables; accepted: 1 to {MOST_CABLES} cables")
    lengths = np.array(lengths, float)
    if lengths.shape != (m,) or not np.all(np.isfinite(lengths) & (lengths > 0.0)):
        found = f"{lengths.size} numbers" if lengths.shape != (m,) else "NaN or one <= 0"
        raise EquilibriumError(f"lengths: found {found}; accepted: {m} finite numbers > 0 [m]")
    return lengths


def _within_reach(platform: HangingPlatform, lengths: Array, taut: list[int]) -> bool:
    """Whether any two of the cables can be taut at once, as far as distances tell."""
    A, B = platform.cables.p_WA, platform.cables.p_PB
    for i, j in combinations(taut, 2):
        far, arm = np.linalg.norm(A[:, i] - A[:, j]), np.linalg.norm(B[:, i] - B[:, j])
        if far > lengths[i] + lengths[j] + arm or abs(lengths[i] - lengths[j]) > far + arm:
            return False
    return True


def _on_taut(
    platform: HangingPlatform, lengths: Array, taut: list[int]
) -> tuple[list[TautRest], PathCount]:
    """Poses at rest on these cables, all taut, with tensions of any sign."""
    some, none = lengths[taut], PathCount()
    body, home = body_on(platform, taut), platform.home
    if platform.num_turns == 0:
        return _points(platform, body, some), none
    if hangs_from_a_point(body):
        spins = platform.num_turns == 3
        return rests_from_a_point(body, some, platform.moves(), home, spins), none
    k = len(taut)
    if platform.num_turns == 1:
        return rests_in_plane(body, some, plane_frame(platform), home)
    return rests_on_two(body, some) if k == 2 else rests_in_space(body, some, home)


def body_on(platform: HangingPlatform, taut: list[int]) -> Body:
    """The platform with some of its cables."""
    cables = platform.cables
    down = platform.weight_W / np.linalg.norm(platform.load())
    return Body(cables.p_WA[:, taut], cables.p_PB[:, taut], np.asarray(platform.p_PCo), down)


def plane_frame(platform: HangingPlatform) -> Array:
    """Of a platform in a plane: columns across the weight, against it, and the normal."""
    up = -platform.load()
    up /= np.linalg.norm(up)
    normal = np.asarray(platform.axis, float) / np.linalg.norm(platform.axis)
    return np.column_stack([np.cross(up, normal), up, normal])


def _points(platform: HangingPlatform, body: Body, lengths: Array) -> list[TautRest]:
    moves, R = platform.moves(), platform.home.rotation()
    across = np.eye(3) - moves @ moves.T
    fixed = across @ platform.home.translation()
    centers = body.p_WA - R.matrix() @ body.p_PB
    square = lengths**2 - np.sum((fixed[:, None] - across @ centers) ** 2, axis=0)
    if np.any(square <= 0.0):
        return []
    found = hanging_points(moves.T @ centers, np.sqrt(square), moves.T @ body.down)
    return [
        TautRest(RigidTransform(R, moves @ point + fixed), tight, closed=True)
        for point, tight in found
    ]


def _kept(
    platform: HangingPlatform, lengths: Array, taut: list[int], found: list[TautRest]
) -> Iterator[EquilibriumPose]:
    """Those with positive tensions and no cable too short, judged and with their certificate."""
    weight = float(np.linalg.norm(platform.load()))
    others = np.setdiff1d(np.arange(len(lengths)), taut)
    for any_one in found:
        one = any_one
        if any_one.family:
            X_WP = member_within_reach(any_one, platform, lengths, others)
            if X_WP is None:
                continue
            one = replace(any_one, X_WP=X_WP)
        shares = one.tight * lengths[taut]
        paths = cable_paths(one.X_WP, platform.cables).lengths
        if np.any(shares <= TENSE) or np.any(paths > lengths + JUST_TAUT):
            continue
        tensions = np.zeros(len(lengths))
        tensions[taut] = shares * weight
        if platform.unbalanced(one.X_WP, tensions) > BALANCED * weight * (1.0 + np.sum(shares)):
            continue
        certificate, radius = certified(platform, one, lengths - paths, others)
        yield make_equilibrium_pose(
            platform, lengths, one.X_WP, tensions, family=one.family, certificate=certificate,
            radius=radius,
        )  # fmt: skip


def certified(
    platform: HangingPlatform, one: TautRest, surplus: Array, others: np.ndarray
) -> tuple[Certificate, float | None]:
    """What stands behind a pose of rest; surplus lengths [m] of `others` are to be positive."""
    if one.closed:
        return Certificate.CLOSED_FORM, None
    box = _proof(one)
    if box is None or not box.tense:
        return Certificate.NUMERICAL, None
    # |R' - R| <= 4 |q' - q| for quaternions of length one and small differences; 5 covers those.
    arms = np.linalg.norm(platform.cables.p_PB, axis=0)
    change = box.off[0] + 5.0 * box.off[1] * arms
    if np.all(surplus[others] > change[others] + 1e-12 * (1.0 + arms[others])):
        return Certificate.PROVEN, box.radius
    return Certificate.PROVEN_TAUT, box.radius


def _proof(one: TautRest) -> ProvenBox | None:
    if one.singular or one.system is None:
        return None
    name, constants, x = one.system
    return prove_rest(constants, x, KINDS[name].rows(), KINDS[name].columns())


def _distinct(rests: list[EquilibriumPose]) -> list[EquilibriumPose]:
    """One of each: the same pose may be held by several sets of just taut cables."""
    kept: list[EquilibriumPose] = []
    for one in rests:
        for other in kept:
            distance, angle = pose_error(one.X_WP, other.X_WP)
            same = distance < SAME_PLACE and angle < SAME_PLACE
            loose = one.certificate == other.certificate == Certificate.NUMERICAL
            same |= loose and distance < 1e-3 and angle < 1e-3  # ends where solutions meet
            if same or (one.family and other.family and _same_family(one, other)):
                break
        else:
            kept.append(one)
    return kept


def _same_family(one: EquilibriumPose, other: EquilibriumPose) -> bool:
    """Whether poses of families are the same but for the turn."""
    alike = np.max(np.abs(one.tensions - other.tensions)) < 1e-6 * np.max(one.tensions)
    return bool(alike and abs(one.energy - other.energy) < 1e-9 * (1.0 + abs(one.energy)))


def _why_none(platform: HangingPlatform, lengths: Array) -> str:
    """In one line why no pose has these lengths."""
    A, B = platform.cables.p_WA, platform.cables.p_PB
    for i, j in combinations(range(len(lengths)), 2):
        missing = float(np.linalg.norm(A[:, i] - A[:, j]) - np.linalg.norm(B[:, i] - B[:, j]))
        missing -= lengths[i] + lengths[j]
        if missing > 0.0:
            return (
                f"lengths: no pose has them: cables {i + 1} and {j + 1} together are "
                f"{missing:.4g} m too short to reach from one exit point to the other; accepted: "
                "lengths that some pose has"
            )
    return (
        "lengths: no pose has them: no set of taut cables holds the platform with all others long "
        "enough; accepted: lengths that some pose has"
    )


def member_within_reach(
    one: TautRest, platform: HangingPlatform, lengths: Array, slack: np.ndarray
) -> RigidTransform | None:
    """A pose of the family at which no cable is too short, the one given if that is one; or None.

    The square of a cable's path is a sinusoid of the angle of turn, so that each cable that is to
    be slack leaves an arc of angles, in closed form. Where the family turns anyhow, `ANY_TURNS`
    orientations are tried.

    Args:
        one: One of the family.
        platform: The platform.
        lengths: Shape (m,) [m].
        slack: Numbers of the cables that are not taut.
    """

    def within(X_WP: RigidTransform) -> bool:
        paths = cable_paths(X_WP, platform.cables).lengths
        return bool(np.all(paths[slack] <= lengths[slack] + JUST_TAUT))

    if within(one.X_WP):
        return one.X_WP
    if one.axis is None:
        return next((X for X in _turned_anyhow(one.X_WP, platform) if within(X)), None)
    point, axis = one.axis
    axis = axis / np.linalg.norm(axis)
    ends = [0.0]
    for j in slack:
        r = one.X_WP.multiply(platform.cables.p_PB[:, j]) - point
        along = axis * (axis @ r)
        across = r - along
        v = point + along - platform.cables.p_WA[:, j]
        c, s = 2.0 * v @ across, 2.0 * v @ np.cross(axis, across)
        size = float(np.hypot(c, s))
        room = lengths[j] ** 2 - v @ v - across @ across
        if abs(room) < size:
            middle, half = np.arctan2(s, c), np.arccos(room / size)
            ends += [middle + half, middle - half]
    ends = sorted(np.mod(ends, 2.0 * np.pi).tolist())
    gaps = np.diff([*ends, ends[0] + 2.0 * np.pi])
    for i in np.argsort(-gaps):
        turn = rotation_from_vector(axis * (ends[i] + 0.5 * gaps[i]))
        R = RotationMatrix.ProjectToRotationMatrix(turn.matrix() @ one.X_WP.rotation().matrix())
        X_WP = RigidTransform(R, point + turn.matrix() @ (one.X_WP.translation() - point))
        if within(X_WP):
            return X_WP
    return None


def _turned_anyhow(X_WP: RigidTransform, platform: HangingPlatform) -> list[RigidTransform]:
    """The platform turned about its centre of mass, the same orientations every time."""
    random, center = np.random.default_rng(0), X_WP.multiply(platform.p_PCo)
    poses = []
    for _ in range(ANY_TURNS):
        q = random.normal(size=4)
        s, v = q[0] / np.linalg.norm(q), q[1:] / np.linalg.norm(q)
        angle = 2.0 * np.arctan2(np.linalg.norm(v), s)
        R = rotation_from_vector(v / np.linalg.norm(v) * angle)
        poses.append(RigidTransform(R, center - R.matrix() @ platform.p_PCo))
    return poses
