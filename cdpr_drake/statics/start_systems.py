"""Constants of which all complex solutions are known, from which those of any robot are reached.

The number of complex solutions of a system of polynomials is the same for almost all constants.
All solutions for one set of random complex constants, found once, lead along paths to all isolated
ones for any other set: with probability one no path meets a singular point on its way.

The solutions were found by monodromy, `find_start_system`: along random triangles of constants
solutions come back as others, until no more appear. The counts agree with those of elimination.

Source: Sommese and Wampler, 2005, theorem 7.1.1; Duff et al., Solving polynomial systems via
homotopy continuation and monodromy, 2019; counts: Abbasnejad and Carricato, Direct
geometrico-static problem of underconstrained cable-driven parallel robots with n cables, 2015;
Carricato, Inverse geometrico-static problem of underconstrained CDPRs with three cables, 2013.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, lru_cache
from itertools import pairwise
from pathlib import Path

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.kernel_calls import over_rows
from cdpr_drake.statics.equilibrium_equations_kernel import CONSTANTS, UNKNOWNS_OF_POSE
from cdpr_drake.statics.homotopy_kernel import FOUND, follow_many

_FILE = Path(__file__).parent / "start_systems.npz"

SAME = 1e-6
"""Solutions that differ by less, relative to their size, are one."""

DOWN = {False: (0.0, 0.0, -1.0), True: (0.0, -1.0, 0.0)}
"""Direction of the weight in start systems, by whether the platform is planar."""


@dataclass(frozen=True)
class Kind:
    """A kind of systems of equations.

    Attributes:
        taut: Number of taut cables k.
        planar: Whether the platform moves along x and y and turns about z only.
        placed: Whether the position is given and the lengths are not.
        count: Isolated complex solutions that a generic system has.
    """

    taut: int
    planar: bool
    placed: bool
    count: int

    @property
    def name(self) -> str:
        """A word for files."""
        return f"{'planar' if self.planar else 'spatial'}_{'placed_' * self.placed}{self.taut}"

    def rows(self) -> np.ndarray:
        """Equations that hold, of those of `rest_equations`."""
        k = self.taut
        lengths = [] if self.placed else list(range(k))
        balance = [k, k + 1, k + 5] if self.planar else list(range(k, k + 6))
        return np.array([*lengths, *balance, k + 6])

    def columns(self) -> np.ndarray:
        """Unknowns that are not fixed."""
        place = [] if self.placed else [0, 1] if self.planar else [0, 1, 2]
        turn = [3, 6] if self.planar else [3, 4, 5, 6]
        return np.array([*place, *turn, *range(UNKNOWNS_OF_POSE, UNKNOWNS_OF_POSE + self.taut)])


KINDS = {
    kind.name: kind
    for kind in (
        Kind(3, False, False, 156),
        Kind(4, False, False, 216),
        Kind(5, False, False, 140),
        Kind(6, False, False, 40),
        Kind(3, False, True, 24),
        Kind(2, True, False, 12),
        Kind(3, True, False, 6),
        Kind(2, True, True, 4),
    )
}
"""Systems that are solved along paths, by name. Two cables of a spatial robot lie in a plane."""


@dataclass(frozen=True, eq=False)
class StartSystem:
    """Constants, shape (k + 1, 7), and all their solutions, shape (count, k + 7), complex."""

    constants: Array
    solutions: Array


@cache
def start_system(name: str) -> StartSystem:
    """The start system of a kind, from the file that comes with the package."""
    with np.load(_FILE) as data:
        return StartSystem(data[f"{name}_constants"], data[f"{name}_solutions"])


@lru_cache(maxsize=len(KINDS))
def moved_start(kind: Kind, start: StartSystem, seed: int) -> StartSystem:
    """The same for other random constants; fewer solutions where a path there fails."""
    constants = _random_constants(kind, np.random.default_rng([seed, kind.count]))
    X = start.solutions.copy()
    ends = follow_all(kind, start.constants, constants[None], X, np.full(len(X), 0.3))
    return StartSystem(constants, distinct(X[ends[:, 0] == FOUND], kind))


def write_start_systems(path: Path, seed: int) -> Iterator[tuple[str, int]]:
    """Finds start systems of all kinds and writes their file; gives names and counts as it goes."""
    arrays = {}
    for name, kind in KINDS.items():
        found = find_start_system(kind, seed)
        arrays[f"{name}_constants"] = found.constants
        arrays[f"{name}_solutions"] = found.solutions
        yield name, len(found.solutions)
    np.savez_compressed(path, allow_pickle=False, **arrays)


def find_start_system(kind: Kind, seed: int, quiet: int = 12) -> StartSystem:
    """All solutions for random constants, by monodromy.

    Args:
        kind: The kind of systems.
        seed: Of the random numbers.
        quiet: Loops in a row without a new solution after which there are no more.
    """
    random = np.random.default_rng(seed)
    constants, first = _random_solved(kind, random)
    found, silent = first[None], 0
    while silent < quiet:
        corners = [constants, *(_random_constants(kind, random) for _ in range(2)), constants]
        moved, good = found.copy(), np.ones(len(found), bool)
        for start, end in pairwise(corners):
            ends = follow_all(kind, start, end[None], moved, np.ones(len(moved)))
            good &= ends[:, 0] == FOUND
        grown = distinct(np.concatenate([found, moved[good]]), kind)
        silent = 0 if len(grown) > len(found) else silent + 1
        found = grown
    return StartSystem(constants, found)


def follow_all(kind: Kind, start: Array, targets: Array, X: Array, care: Array) -> Array:
    """Moves solutions X from `start` to targets, see `follow_many`; (code, change, ratio) each."""
    ends = np.zeros((len(X), 3))
    over_rows(
        follow_many, len(X), None, start, np.ascontiguousarray(targets), X, kind.rows(),
        kind.columns(), care, ends,
    )  # fmt: skip
    return ends


def distinct(X: Array, kind: Kind) -> Array:
    """Solutions without those that are the same, q and -q and all scales of it being one."""
    kept: list[int] = []
    marks = signatures(X, kind)
    for i, mark in enumerate(marks):
        size = SAME * (1.0 + np.max(np.abs(mark)))
        if not kept or np.min(np.max(np.abs(marks[kept] - mark), axis=1)) > size:
            kept.append(i)
    return X[kept]


def signatures(X: Array, kind: Kind) -> Array:
    """Numbers of solutions that no scale of q changes: p, lambda, and R, shape (count, k + 12)."""
    p, q, tight = X[:, :3], X[:, 3:7], X[:, 7:]
    R = np.einsum("ni,nj->nij", q, q) / np.sum(q * q, axis=1)[:, None, None]
    return np.concatenate([p, R[:, *np.triu_indices(4)], tight], axis=1)


def _random(random: np.random.Generator, *shape: int) -> Array:
    return (random.normal(size=shape) + 1j * random.normal(size=shape)) / np.sqrt(2.0)


def _random_constants(kind: Kind, random: np.random.Generator) -> Array:
    P = _random(random, kind.taut + 1, CONSTANTS)
    if kind.planar:
        P[:, [2, 5]] = 0.0
    P[-1, 2 if kind.planar else 3 :] = 0.0
    P[-1, 3:6] = DOWN[kind.planar]
    return P


def _random_solved(kind: Kind, random: np.random.Generator) -> tuple[Array, Array]:
    """Random constants with one solution: the balance is linear in forces and centre of mass."""
    k, P = kind.taut, _random_constants(kind, random)
    x = _random(random, UNKNOWNS_OF_POSE + k)
    if kind.planar:
        x[[2, 4, 5]] = 0.0
    if kind.placed:
        x[:3] = 0.0
    q = x[3:7]
    D, R = q @ q, np.empty((3, 3), complex)
    s, v = q[0], q[1:]
    S = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    R = ((s * s - v @ v) * np.eye(3) + 2.0 * np.outer(v, v) + 2.0 * s * S) / D
    arms, w = R @ P[:k, 3:6].T, P[k, 3:6]
    A = np.zeros((6, 3 * k + 3), complex)
    for i in range(k):
        A[:3, 3 * i : 3 * i + 3] = np.eye(3)
        A[3:, 3 * i : 3 * i + 3] = np.cross(arms[:, i], np.eye(3)).T
    A[3:, 3 * k :] = np.cross(w, np.eye(3)).T @ R  # - (R c) x w = w x (R c)
    unknown = np.concatenate([(x[:3, None] + arms - P[:k, :3].T).T.ravel(), P[k, :3]])
    if kind.planar:
        fixed = [3 * i + 2 for i in range(k + 1)]
        A[:, fixed], unknown[fixed] = 0.0, 0.0
    right = np.concatenate([w, np.zeros(3)])
    unknown += np.linalg.lstsq(A, right - A @ unknown, rcond=1e-12)[0]
    forces = unknown[: 3 * k].reshape(k, 3)
    P[k, :3] = unknown[3 * k :]
    lines = forces / x[7:, None]
    P[:k, :3] = x[:3] + arms.T - lines
    P[:k, 6] = np.sum(lines * lines, axis=1)
    return P, x
