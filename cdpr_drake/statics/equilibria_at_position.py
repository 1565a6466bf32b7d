"""Where the platform's position is given: the turns, lengths and tensions at which it rests there.

A body in space has as many turns as three taut cables can balance, one in a plane two: with these,
poses are isolated. A platform with more cables rests on such a set of them, the others slack.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import EquilibriumError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.statics.equilibrium_enumeration import TENSE, body_on, certified, plane_frame
from cdpr_drake.statics.inextensible_problem import (
    EquilibriumPose,
    HangingPlatform,
    make_equilibrium_pose,
)
from cdpr_drake.statics.real_solutions import PathCount
from cdpr_drake.statics.taut_equilibria import hangs_from_a_point, rests_in_plane, rests_in_space


@dataclass(frozen=True, eq=False)
class EquilibriaAtPosition:
    """Poses of rest at a position.

    Attributes:
        rests: The poses, the lowest energy first; cables that are not among `taut` are slack.
        lengths: Lengths of all cables at each, shape (m,) [m]: of the slack ones the straight
            path, than which they have to be longer.
        paths: How the paths to all complex solutions ended.
    """

    rests: list[EquilibriumPose]
    lengths: list[Array]
    paths: PathCount


def enumerate_at_position(
    platform: HangingPlatform, p_WP: Array, taut: list[int]
) -> EquilibriaAtPosition:
    """All poses of rest with Po at a position, stable or not, on given cables.

    Stability is that with the lengths held.

    Args:
        platform: The platform; its pulleys are left out.
        p_WP: Position of Po, shape (3,) [m]; of a platform in a plane, in it.
        taut: The cables that hold it, by number from 0: three, or two of a body in a plane.

    Raises:
        EquilibriumError: A platform or cables that this does not fit, or there is no such pose.
    """
    platform = replace(platform, cables=platform.cables.without_pulleys())
    weight = float(np.linalg.norm(platform.load()))
    m, needed = platform.cables.count, {3: 3, 1: 2}.get(platform.num_turns)
    if needed is None:
        raise EquilibriumError(
            "equilibria: found a point mass at a given position, which turns nothing; accepted: a "
            "body in space or in a plane"
        )
    if len(set(taut)) != needed or len(taut) != needed or not all(0 <= i < m for i in taut):
        words = ", ".join(str(i + 1) for i in taut) or "none"
        raise EquilibriumError(
            f"taut cables: found {words}; accepted: {needed} different ones of 1 to {m}, as many "
            "as leave isolated poses at a position"
        )
    place = np.asarray(p_WP, float)
    if place.shape != (3,) or not np.all(np.isfinite(place)):
        raise EquilibriumError("position: found no three finite numbers; accepted: x, y, z [m]")
    moves, origin = platform.moves(), platform.home.translation()
    off = float(np.linalg.norm((np.eye(3) - moves @ moves.T) @ (place - origin)))
    if off > 1e-9 * (1.0 + float(np.linalg.norm(place))):
        raise EquilibriumError(
            f"position: found one {off:.4g} m off the platform's plane; accepted: one in it"
        )
    body, home = body_on(platform, taut), RigidTransform(platform.home.rotation(), place)
    if hangs_from_a_point(body):
        raise EquilibriumError(
            "taut cables: found cables that end at one point of the platform, about which it "
            "turns freely; accepted: different anchor points"
        )
    if platform.num_turns == 1:
        found, count = rests_in_plane(body, None, plane_frame(platform), home)
    else:
        found, count = rests_in_space(body, None, home)
    rests, lengths = [], []
    for one in found:
        if np.any(one.tight <= TENSE):
            continue
        paths = cable_paths(one.X_WP, platform.cables).lengths
        tensions = np.zeros(m)
        tensions[taut] = one.tight * paths[taut] * weight
        certificate, radius = certified(platform, one, paths, np.arange(0))
        longer = paths.copy()
        longer[np.setdiff1d(np.arange(m), taut)] += 1.0
        rest = make_equilibrium_pose(
            platform, longer, one.X_WP, tensions, family=False, certificate=certificate,
            radius=radius,
        )  # fmt: skip
        rests.append(rest)
        lengths.append(paths)
    if not rests:
        raise EquilibriumError(
            "position: no turn balances the platform there with these cables pulling; accepted: a "
            "position at which one does"
        )
    order = np.argsort([one.energy for one in rests])
    return EquilibriaAtPosition([rests[i] for i in order], [lengths[i] for i in order], count)
