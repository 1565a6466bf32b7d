"""The surface of a workspace seen from a centre: rays, bisection, a sphere of triangles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import WorkspaceError

Holds = Callable[[Array], np.ndarray]
"""Which positions, shape (n, 3) [m], belong to the workspace, shape (n,)."""

FIRST_STEPS = 48
"""Points along a ray that are looked at before bisection: gaps wider than the ray by this are
found."""


@dataclass(frozen=True, eq=False)
class WorkspaceHull:
    """Triangles around the part of a workspace that can be seen from a centre.

    Along each ray it ends where the workspace ends first, or at the border of a box: it is
    star-shaped, and says nothing about what lies behind.

    Attributes:
        center: Where the rays begin, shape (3,) [m].
        vertices: Ends of the rays, shape (v, 3) [m].
        faces: Triangles, counterclockwise seen from outside, shape (f, 3).
        cut: Which rays end at the border of the box, shape (v,).
        tolerance: How far an end may be from the border of the workspace along the ray [m].
    """

    center: Array
    vertices: Array
    faces: np.ndarray
    cut: np.ndarray
    tolerance: float

    @property
    def volume(self) -> float:
        """Enclosed volume [m^3]."""
        return float(np.sum(self._volumes()))

    @property
    def area(self) -> float:
        """Area of the triangles [m^2]."""
        a, b, c = (self.vertices[self.faces[:, k]] for k in range(3))
        return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())

    @property
    def centroid(self) -> Array:
        """Centre of the enclosed volume, shape (3,) [m]."""
        weights = self._volumes()
        middles = (self.vertices[self.faces].sum(axis=1) + self.center) / 4.0
        return np.asarray(weights @ middles / np.sum(weights), float)

    def _volumes(self) -> Array:
        """Of the tetrahedra from the centre to each triangle."""
        a, b, c = (self.vertices[self.faces[:, k]] - self.center for k in range(3))
        return np.asarray(np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0, float)


def workspace_hull(
    holds: Holds,
    center: Array,
    lower: Array,
    upper: Array,
    *,
    rays: int = 10_000,
    tolerance: float = 1e-3,
    steps: int = FIRST_STEPS,
    likely: tuple[Array, Array] | None = None,
) -> WorkspaceHull:
    """Finds the hull by rays, more of them where the surface bends.

    Args:
        holds: What belongs to the workspace.
        center: Where rays begin, shape (3,) [m]; must belong to it.
        lower: Lower corner of the box at whose border rays end, shape (3,) [m].
        upper: Upper corner, shape (3,) [m].
        rays: How many, at most.
        tolerance: How near to the border of the workspace they end, along the ray [m].
        steps: Points along a ray to the box that are looked at before bisection, see `FIRST_STEPS`.
        likely: Corners of a box in which a position that belongs to the workspace is looked for,
            to name one; None: the box.

    Raises:
        WorkspaceError: The centre does not belong to the workspace (says a position that does, if
            one is found), lies outside the box, or a number is not accepted.

    Source: Pott, Forward kinematics and workspace determination of a wire robot for industrial
    applications, 2008.
    """
    center = np.asarray(center, float)
    lower, upper = np.asarray(lower, float), np.asarray(upper, float)
    if rays < 12 or not (np.isfinite(tolerance) and tolerance > 0.0):
        raise WorkspaceError(
            f"hull: found {rays} rays, tolerance {tolerance:g}; accepted: at least 12, above 0 [m]"
        )
    if np.any(center <= lower) or np.any(center >= upper):
        raise WorkspaceError(
            f"hull: center: found {_words(center)}; accepted: within {_words(lower)} to "
            f"{_words(upper)} [m]"
        )
    if not holds(center[np.newaxis])[0]:
        where = _somewhere(holds, *((lower, upper) if likely is None else likely))
        raise WorkspaceError(
            f"hull: center: found {_words(center)}, which is outside the workspace; accepted: a "
            f"position inside{where}"
        )
    directions, faces = _icosahedron()
    found, cut = _ends(holds, center, directions, (lower, upper), tolerance, steps)
    while True:
        marked = _bent(found, faces)
        # An edge that is halved costs one ray.
        edges = _edges(faces)
        bent = marked[edges].any(axis=1) if len(faces) >= 80 else np.ones(len(edges), bool)
        most = rays - len(directions)
        if most < 1 or not np.any(bent):
            break
        directions, faces, added = _refined(directions, faces, edges, bent, most)
        if added == 0:
            break
        more, more_cut = _ends(holds, center, directions[-added:], (lower, upper), tolerance, steps)
        found, cut = np.concatenate([found, more]), np.concatenate([cut, more_cut])
    return WorkspaceHull(center, found, faces, cut, tolerance)


def _words(p: Array) -> str:
    return "(" + ", ".join(f"{x:g}" for x in p) + ")"


def _somewhere(holds: Holds, lower: Array, upper: Array) -> str:
    """Words for a position that belongs to the workspace, the deepest of a coarse grid."""
    axes = [np.linspace(a, b, 23)[1:-1] for a, b in zip(lower, upper, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = points[holds(points)]
    if not len(inside):
        return "; none was found on a grid of 21 x 21 x 21"
    middle = np.median(inside, axis=0)
    return f", such as {_words(inside[np.argmin(np.sum((inside - middle) ** 2, axis=1))])}"


def _ends(
    holds: Holds, center: Array, directions: Array, box: tuple[Array, Array], tolerance: float,
    count: int,
) -> tuple[Array, np.ndarray]:  # fmt: skip
    """Where rays end, shape (n, 3), and whether at the border of the box, shape (n,)."""
    with np.errstate(divide="ignore"):
        border = np.where(directions > 0.0, box[1] - center, box[0] - center) / directions
    far = np.min(np.where(directions == 0.0, np.inf, border), axis=1)
    steps = np.linspace(0.0, 1.0, count + 1)[1:]
    inner, outer = np.zeros(len(far)), far.copy()
    alive = np.ones(len(far), bool)
    for step in steps:
        s = step * far[alive]
        good = holds(center + s[:, np.newaxis] * directions[alive])
        index = np.flatnonzero(alive)
        inner[index[good]] = s[good]
        outer[index[~good]] = s[~good]
        alive[index[~good]] = False
        if not np.any(alive):
            break
    cut = alive
    while True:
        open_ = np.flatnonzero(outer - inner > tolerance)
        if not len(open_):
            break
        s = 0.5 * (inner[open_] + outer[open_])
        good = holds(center + s[:, np.newaxis] * directions[open_])
        inner[open_[good]] = s[good]
        outer[open_[~good]] = s[~good]
    middle = np.where(cut, far, 0.5 * (inner + outer))
    return center + middle[:, np.newaxis] * directions, cut


def _icosahedron() -> tuple[Array, np.ndarray]:
    """Unit directions and triangles of a sphere of twenty."""
    g = 0.5 * (1.0 + np.sqrt(5.0))
    corners = np.array(
        [
            (-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g),
            (0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1),
        ]
    )  # fmt: skip
    faces = np.array(
        [
            (0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4),
            (11, 10, 2), (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8),
            (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1),
        ]
    )  # fmt: skip
    return corners / np.linalg.norm(corners, axis=1, keepdims=True), faces


def _edges(faces: np.ndarray) -> np.ndarray:
    """Edges of triangles, each once, shape (e, 2), ascending."""
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    return np.unique(np.sort(pairs, axis=1), axis=0)


BEND = np.cos(np.radians(3.0))
"""Triangles whose normals differ by more bend the surface."""


def _bent(points: Array, faces: np.ndarray) -> np.ndarray:
    """Which vertices lie on an edge where the surface bends, shape (v,)."""
    a, b, c = (points[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    owner: dict[tuple[int, int], int] = {}
    marked = np.zeros(len(points), bool)
    for number, face in enumerate(faces):
        for k in range(3):
            i, j = int(face[k]), int(face[(k + 1) % 3])
            other = owner.pop((min(i, j), max(i, j)), None)
            if other is None:
                owner[min(i, j), max(i, j)] = number
            elif normals[number] @ normals[other] < BEND:
                marked[[i, j]] = True
    return marked


def _refined(
    directions: Array, faces: np.ndarray, edges: np.ndarray, bent: np.ndarray, most: int
) -> tuple[Array, np.ndarray, int]:
    """Halves bent edges, the longest first, and all triangles that they bound; count of new ones.

    A triangle with one, two or three halved edges becomes two, three or four.
    """
    chosen = edges[bent]
    angle = np.einsum("ij,ij->i", directions[chosen[:, 0]], directions[chosen[:, 1]])
    chosen = chosen[np.argsort(angle, kind="stable")[:most]]
    middles = directions[chosen[:, 0]] + directions[chosen[:, 1]]
    middles /= np.linalg.norm(middles, axis=1, keepdims=True)
    start = len(directions)
    number = {(int(i), int(j)): start + k for k, (i, j) in enumerate(chosen)}
    made: list[tuple[int, int, int]] = []
    for face in faces.tolist():
        cuts = [
            number.get((min(a, b), max(a, b)))
            for a, b in zip(face, face[1:] + face[:1], strict=True)
        ]
        made += _split(face, cuts)
    return np.concatenate([directions, middles]), np.array(made), len(chosen)


def _split(face: list[int], cuts: list[int | None]) -> list[tuple[int, int, int]]:
    """A triangle with the middles of its edges, None where an edge is whole."""
    a, b, c = face
    p, q, r = cuts
    if p is not None and q is not None and r is not None:
        return [(a, p, r), (p, b, q), (r, q, c), (p, q, r)]
    for _ in range(3):
        if p is not None and q is not None:
            return [(p, b, q), (a, p, q), (a, q, c)]
        if p is not None and r is None and q is None:
            return [(a, p, c), (p, b, c)]
        a, b, c, p, q, r = b, c, a, q, r, p
    return [(a, b, c)]
