"""Poses of rest that turns lead to from one of them: which of these lets the slack cables be slack.

The square of a cable's path is a sinusoid of the angle of turn, so that each cable that is to be
slack leaves an arc of angles, in closed form.
"""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.equilibria.problem import JUST_TAUT, HangingPlatform
from cdpr_drake.equilibria.taut_bodies import TautRest
from cdpr_drake.geometry import cable_paths
from cdpr_drake.spatial import rotation_from_vector

ANY_TURNS = 500
"""Orientations that are tried where a platform turns anyhow about its centre of mass."""


def member_within_reach(
    one: TautRest, platform: HangingPlatform, lengths: Array, slack: np.ndarray
) -> RigidTransform | None:
    """A pose of the family at which no cable is too short, the one given if that is one; or None.

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
