"""A body, or a point, at rest on inextensible cables that are all taut: all poses of it.

On one point a body hangs like a pendulum, in closed form. On two cables a body in space is in the
vertical plane of their exit points, either way round. Everything else is a system of polynomials.
Where the point itself rests, `hanging_points` says, in closed form.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.statics.real_solutions import PathCount, real_solutions

COINCIDE = 1e-9
"""Points nearer than this, relative to lengths, are one; centres nearer to a line lie on it."""


@dataclass(frozen=True, eq=False)
class Body:
    """Exit points, shape (3, k), anchors (3, k), centre of mass (3,) [m]; unit weight (3,)."""

    p_WA: Array
    p_PB: Array
    p_PCo: Array
    down: Array


@dataclass(frozen=True, eq=False)
class TautRest:
    """A pose of rest with all cables taut.

    Attributes:
        X_WP: The pose.
        tight: Tensions per length and weight, shape (k,), of any sign [1/m].
        family: Whether turns lead to others.
        axis: Point and direction in W about which they do, each shape (3,); None of a family that
            turns anyhow.
        closed: Whether it is in closed form.
        singular: Whether solutions meet there.
        system: What a proof needs: name of the kind, constants in metres, and the solution.
    """

    X_WP: RigidTransform
    tight: Array
    family: bool = False
    axis: tuple[Array, Array] | None = None
    closed: bool = False
    singular: bool = False
    system: tuple[str, Array, Array] | None = None


def hangs_from_a_point(body: Body) -> bool:
    """Whether all anchor points are one."""
    spread = np.max(np.abs(body.p_PB - body.p_PB[:, :1]))
    return bool(spread <= COINCIDE * (1.0 + np.max(np.abs(body.p_PB))))


def rests_from_a_point(
    body: Body, lengths: Array, moves: Array, home: RigidTransform, spins: bool
) -> list[TautRest]:
    """Poses on cables that all end at one point of the body, in closed form.

    Args:
        body: The body.
        lengths: Shape (k,) [m].
        moves: Directions of motion of the body, columns, shape (3, d).
        home: A pose that it can have.
        spins: Whether it also turns about the vertical: a body in space.
    """
    R0, origin = home.rotation().matrix(), home.translation()
    anchor, found = body.p_PB[:, 0], []
    low = body.p_PCo - anchor
    # Out of the plane nothing moves: only what is left of a length counts.
    across = np.eye(3) - moves @ moves.T
    offset = across @ (origin + R0 @ anchor)
    out = np.linalg.norm(offset[:, None] - across @ body.p_WA, axis=0)
    square = lengths**2 - out**2
    if np.any(square <= 0.0):
        return []
    down = moves @ (moves.T @ body.down)
    flat = low if spins else R0.T @ moves @ (moves.T @ (R0 @ low))
    for point, tight in hanging_points(moves.T @ body.p_WA, np.sqrt(square), moves.T @ down):
        if np.linalg.norm(flat) <= COINCIDE * (1.0 + np.max(lengths)):
            turns = [np.eye(3)]
        else:
            turns = [_turn(R0 @ flat, sign * down, moves) for sign in (1.0, -1.0)]
        for turn in turns:
            R = turn @ R0
            p = moves @ point + offset - R @ anchor
            if not spins:
                p = moves @ (moves.T @ p) + across @ origin
            X = RigidTransform(RotationMatrix.ProjectToRotationMatrix(R), p)
            axis = None
            if len(turns) == 1 and not spins:
                axis = (X.multiply(anchor), np.cross(moves[:, 0], moves[:, 1]))
            elif len(turns) == 2 and spins:
                axis = (X.multiply(anchor), body.down)
            found.append(TautRest(X, tight, spins or len(turns) == 1, axis, closed=True))
    return found


def rests_in_plane(
    body: Body, lengths: Array | None, frame: Array, home: RigidTransform
) -> tuple[list[TautRest], PathCount]:
    """Poses of a body that moves in a plane, on two or three cables.

    Args:
        body: The body; the part of its weight in the plane counts and is not zero.
        lengths: Shape (k,) [m]; None: the position is that of `home`, the turn and lengths free.
        frame: Columns in W: across the weight in the plane, against the weight, the normal.
        home: A pose that the body can have.
    """
    R0, origin = frame.T @ home.rotation().matrix(), home.translation()
    a = frame.T @ (body.p_WA - origin[:, None])
    b, c = R0 @ body.p_PB, R0 @ body.p_PCo
    k = a.shape[1]
    constants = np.zeros((k + 1, 7))
    constants[:k, :2], constants[:k, 3:5] = a[:2].T, b[:2].T
    constants[k, :2], constants[k, 3:6] = c[:2], (0.0, -1.0, 0.0)
    if lengths is not None:
        constants[:k, 6] = lengths**2 - (b[2] - a[2]) ** 2
        if np.any(constants[:k, 6] <= 0.0):
            return [], PathCount()
        solved, count = _solved(f"planar_{k}", constants)
    else:
        solved, count = _solved(f"planar_placed_{k}", constants)
    rests = []
    for p, R, tight, singular, system in solved:
        turned = frame @ R @ R0
        place = origin + frame @ np.array([p[0], p[1], 0.0])
        X = RigidTransform(RotationMatrix.ProjectToRotationMatrix(turned), place)
        rests.append(TautRest(X, tight, singular=singular, system=system))
    return rests, count


def rests_on_two(body: Body, lengths: Array) -> tuple[list[TautRest], PathCount]:
    """Poses of a body in space on two cables: in the vertical plane of the exit points."""
    up = -body.down
    along = body.p_WA[:, 1] - body.p_WA[:, 0]
    level = along - up * (up @ along)
    size = float(np.max(lengths))
    above = float(np.linalg.norm(level)) < COINCIDE * size
    if above:  # one exit point above the other: all vertical planes are alike
        level = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
    level = level / np.linalg.norm(level)
    frame = np.column_stack([level, up, np.cross(level, up)])
    x = body.p_PB[:, 1] - body.p_PB[:, 0]
    x = x / np.linalg.norm(x)
    low = body.p_PCo - body.p_PB[:, 0]
    y = low - x * (x @ low)
    straight = float(np.linalg.norm(y)) < COINCIDE * size
    if straight:
        y = np.cross(x, np.eye(3)[int(np.argmin(np.abs(x)))])
    y = y / np.linalg.norm(y)
    of_body, total = np.column_stack([x, y, np.cross(x, y)]), PathCount()
    rests = []
    for side in (1.0, -1.0)[: 1 if straight else 2]:
        R0 = frame @ np.diag([1.0, side, side]) @ of_body.T
        p = body.p_WA[:, 0] - R0 @ body.p_PB[:, 0]
        home = RigidTransform(RotationMatrix.ProjectToRotationMatrix(R0), p)
        found, count = rests_in_plane(body, lengths, frame, home)
        total.add(count)
        for one in found:
            ends = one.X_WP.multiply(body.p_PB)
            axis = (ends[:, 0], ends[:, 1] - ends[:, 0]) if straight else None
            axis = (body.p_WA[:, 0], up) if above else axis
            rests.append(replace(one, family=straight or above, axis=axis))
    return rests, total


def rests_in_space(
    body: Body, lengths: Array | None, home: RigidTransform
) -> tuple[list[TautRest], PathCount]:
    """Poses of a body in space on three to six cables.

    Args:
        body: The body.
        lengths: Shape (k,) [m]; None, of three cables: the position is that of `home`.
        home: A pose that the body can have.
    """
    k = body.p_WA.shape[1]
    # Where the weight is not along -z of W, the world is turned so that it is.
    turn = _turn(body.down, np.array([0.0, 0.0, -1.0]), np.eye(3))
    constants = np.zeros((k + 1, 7))
    origin = home.translation() if lengths is None else np.mean(body.p_WA, axis=1)
    constants[:k, :3] = (turn @ (body.p_WA - origin[:, None])).T
    constants[:k, 3:6] = body.p_PB.T
    constants[k, :3], constants[k, 3:6] = body.p_PCo, (0.0, 0.0, -1.0)
    if lengths is not None:
        constants[:k, 6] = lengths**2
    solved, count = _solved(f"spatial_{'placed_' * (lengths is None)}{k}", constants)
    rests = []
    for p, R, tight, singular, system in solved:
        X = RigidTransform(RotationMatrix.ProjectToRotationMatrix(turn.T @ R), origin + turn.T @ p)
        rests.append(TautRest(X, tight, singular=singular, system=system))
    return rests, count


def _turn(vector: Array, onto: Array, moves: Array) -> Array:
    """The least rotation of a vector into a direction, shape (3, 3); in the plane of moves."""
    u, v = vector / np.linalg.norm(vector), onto / np.linalg.norm(onto)
    axis, cosine = np.cross(u, v), float(u @ v)
    if cosine < -1.0 + 1e-12:  # half a turn
        if moves.shape[1] == 2:
            axis = np.cross(moves[:, 0], moves[:, 1])
        else:
            axis = np.cross(u, np.eye(3)[int(np.argmin(np.abs(u)))])
        axis /= np.linalg.norm(axis)
        return np.asarray(2.0 * np.outer(axis, axis) - np.eye(3), float)
    S = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.asarray(np.eye(3) + S + S @ S / (1.0 + cosine), float)


_Solved = tuple[Array, Array, Array, bool, tuple[str, Array, Array]]
"""p, R, tensions per length and weight, whether singular, what a proof needs."""


def _solved(name: str, constants: Array) -> tuple[list[_Solved], PathCount]:
    """Real solutions of a system with constants in metres."""
    scale = float(np.sqrt(np.mean(np.sum(constants[:-1, :3] ** 2, axis=1))))
    scale = max(scale, float(np.max(np.abs(constants[:, :3]))) * 1e-3, 1e-9)
    small = constants / scale
    small[:-1, 6] /= scale
    small[-1, 3:6] = constants[-1, 3:6]
    found, count = real_solutions(name, small)
    solved = []
    for x, singular in found:
        s, v = x[3], x[4:7]
        S = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
        R = (s * s - v @ v) * np.eye(3) + 2.0 * np.outer(v, v) + 2.0 * s * S
        full = np.concatenate([scale * x[:3], x[3:7], x[7:] / scale])
        solved.append((full[:3], R, full[7:], singular, (name, constants, full)))
    return solved, count


def hanging_points(centers: Array, radii: Array, down: Array) -> list[tuple[Array, Array]]:
    """Points at rest on k taut cables, and shares of the weight.

    The taut cables put the point on spheres. Their differences are planes; in what these have in
    common, the spheres are one, of which the lowest and the highest point are at rest.

    Args:
        centers: Where the cables end in the space of motions, shape (d, k) [m].
        radii: How far the point is from each, shape (k,) [m].
        down: Weight in that space, shape (d,) [N].

    Returns:
        Points, shape (d,) [m], and tensions per distance, shape (k,) [N/m], of any sign: none
        where cables cannot all be taut, or the centres lie on one line or plane too many.
    """
    d, k = centers.shape
    if k > d or np.any(radii <= 0.0):
        return []
    first, size = centers[:, 0], float(np.max(radii))
    N = (centers[:, 1:] - first[:, None]).T
    right = 0.5 * (np.sum(N * N, axis=1) + radii[0] ** 2 - radii[1:] ** 2)
    if k > 1:
        U, s, V = np.linalg.svd(N)
        if s[-1] < COINCIDE * size:
            return []
        foot = V[: k - 1].T @ ((U.T @ right) / s)
        left = V[k - 1 :].T
    else:
        foot, left = np.zeros(d), np.eye(d)
    square = radii[0] ** 2 - foot @ foot
    if square < 0.0:
        return []
    along = left @ (left.T @ down)
    length = float(np.linalg.norm(along))
    if length < COINCIDE * np.linalg.norm(down):
        return []  # all of a circle is level: no cables of its axis balance a weight along it
    points = []
    for sign in (1.0, -1.0):
        point = first + foot + sign * np.sqrt(square) * along / length
        lines = point[:, None] - centers
        tight, _, rank, _ = np.linalg.lstsq(lines, down, rcond=COINCIDE)
        if rank == k and np.max(np.abs(lines @ tight - down)) < 1e-7 * np.linalg.norm(down):
            points.append((point, tight))
    return points
