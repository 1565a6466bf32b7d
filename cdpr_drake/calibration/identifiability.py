"""What measurements cannot tell, in words: gauge freedoms, and parameters that look alike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import eigh, null_space

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.elimination import UNTOLD
from cdpr_drake.calibration.stations import Point
from cdpr_drake.geometry.poses import cross_matrix
from cdpr_drake.numerics.null_directions import SHARE, named_direction, sparse_basis

FRAMES = tuple(
    f"{what} of the {frame} frame {how} {axis}"
    for frame in ("world", "platform")
    for what, how in (("rotation", "about"), ("translation", "along"))
    for axis in "xyz"
)
"""Gauge freedoms in the order of `frame_motions`."""


LOOSE = 1.0
"""A frame whose place is told no better than what is typically unknown of a point is loose."""


@dataclass(frozen=True, eq=False)
class Identifiability:
    """What can be told of the free parameters.

    Attributes:
        gauge: Motions of frames that change nothing that is measured, in words.
        untold: Every other direction that cannot be told, in words.
        gauge_basis: Orthonormal, in typical sizes, shape (f, g).
        untold_basis: Orthonormal beyond the gauge, shape (f, u).
    """

    gauge: tuple[str, ...]
    untold: tuple[str, ...]
    gauge_basis: Array
    untold_basis: Array


def frame_motions(at: Point, free: npt.NDArray[np.bool_] | None = None) -> Array:
    """How parameters change as the world or the platform frame moves, in typical sizes, (n, 12).

    The world moves exit points, tags and the tracker's frame, the platform anchor points, camera
    and marker; each turns about its axes, then moves along them. The zero of a yaw turns with the
    world about z, where it is free; else it holds the world by what it measures.
    """
    model, where = at.model, at.layout.slices
    G = np.zeros((at.layout.size, 12))

    def points(begin: int, p: Array, column: int) -> None:
        for i in range(p.shape[1]):
            rows = slice(begin + 3 * i, begin + 3 * i + 3)
            G[rows, column : column + 3] = -cross_matrix(p[:, i])
            G[rows, column + 3 : column + 6] = np.eye(3)

    def pose(begin: int, p: Array, column: int) -> None:
        G[begin : begin + 3, column : column + 3] = np.eye(3)
        points(begin + 3, p[:, None], column)

    points(where["exit_points"].start, model.cables.p_WA, 0)
    points(where["anchor_points"].start, model.cables.p_PB, 6)
    pose(where["camera"].start, model.X_PC.translation(), 6)
    for k, X_WT in enumerate(model.tags.values()):
        pose(where["tags"].start + 6 * k, X_WT.translation(), 0)
    pose(where["tracker"].start, model.X_WK.translation(), 0)
    pose(where["marker"].start, model.X_PM.translation(), 6)
    yaw = where["tilt_zeros"].start + 2
    if free is not None and free[yaw]:
        G[yaw, 2] = 1.0
    return G / at.layout.typical[:, None]


def identifiability(
    S: Array, at: Point, free: npt.NDArray[np.bool_], used: npt.NDArray[np.bool_]
) -> Identifiability:
    """What information leaves open.

    Args:
        S: Information on the free parameters in typical sizes, shape (f, f).
        at: The model.
        free: Which parameters are free, shape (n,).
        used: Which parameters measurements depend on at all, shape (n,); others hold no frame.
    """
    count = int(np.sum(free))
    if not count:
        return Identifiability((), (), np.zeros((0, 0)), np.zeros((0, 0)))
    values, V = eigh(S)
    N = V[:, values <= UNTOLD**2]
    if not N.shape[1]:
        return Identifiability((), (), np.zeros((count, 0)), N)
    G = frame_motions(at, free)
    size = np.linalg.norm(G, axis=0)
    size[size == 0.0] = 1.0
    G = G / size
    # Motions of frames that leave fixed parameters alone and stay within what is not told.
    inside = N @ (N.T @ G[free])
    stays = np.vstack([G[~free & used], G[free] - inside])
    moves = null_space(stays, rcond=1e-5)
    moves = moves[:, np.linalg.norm(G[free] @ moves, axis=0) > 1e-9]
    basis = G[free] @ moves
    if basis.shape[1]:
        U, s, Vt = np.linalg.svd(basis, full_matrices=False)
        keep = s > 1e-9 * s[0]
        basis = U[:, keep]
        if not keep.all():  # motions that change nothing, as of the frame of a point mass
            moves = moves @ Vt[keep].T
    gauge = tuple(
        _joined([FRAMES[j] for j in np.flatnonzero(np.abs(c) > SHARE * np.max(np.abs(c)))])
        for c in sparse_basis(moves).T
    )
    rest = N - basis @ (basis.T @ N)
    U, s, _ = np.linalg.svd(rest, full_matrices=False)
    rest = U[:, s > 1e-5]
    words = [str(word) for word in np.array(at.layout.words)[free]]
    untold = tuple(named_direction(v, words) for v in sparse_basis(rest).T)
    return Identifiability(gauge, untold, basis, rest)


def loose_frames(
    S: Array, at: Point, free: npt.NDArray[np.bool_], used: npt.NDArray[np.bool_]
) -> tuple[str, ...]:
    """Motions of frames that measurements see, but only just, in words.

    Such as a tilt of the world that nothing but upright pulleys of small radius tells. Errors along
    them are large, and matter as little as those of a gauge.

    Args:
        S: Information on the free parameters in typical sizes, shape (f, f).
        at: The model.
        free: Which parameters are free, shape (n,).
        used: Which parameters measurements depend on, shape (n,).
    """
    words = []
    for c, std in _loose(S, at, free, ~free & used)[0]:
        told = [FRAMES[j] for j in np.flatnonzero(np.abs(c) > SHARE * np.max(np.abs(c)))]
        words.append(f"{_joined(told)}, only {std:.2g} times what is typically unknown")
    return tuple(words)


def frame_basis(
    S: Array, at: Point, free: npt.NDArray[np.bool_], used: npt.NDArray[np.bool_]
) -> tuple[Array, Array]:
    """Motions of frames that are not told or loose.

    Returns:
        How parameters change, orthonormal in typical sizes, shape (f, d), and the twists that do
        so, as `moved_frames` takes them, shape (12, d).
    """
    return _loose(S, at, free, ~free & used, with_gauge=True)[1:]


def _loose(
    S: Array,
    at: Point,
    free: npt.NDArray[np.bool_],
    held: npt.NDArray[np.bool_],
    with_gauge: bool = False,
) -> tuple[list[tuple[Array, float]], Array, Array]:
    G = frame_motions(at, free)
    size = np.linalg.norm(G, axis=0)
    size[size == 0.0] = 1.0
    G = G / size
    moves = null_space(np.vstack([G[held], np.zeros((1, 12))]), rcond=1e-9)
    F = G[free] @ moves
    U, s, Vt = np.linalg.svd(F, full_matrices=False)
    keep = s > 1e-9
    U, moves = U[:, keep], moves @ (Vt[keep].T / s[keep])
    if not U.shape[1]:
        return [], U, np.zeros((12, 0))
    values, V = eigh(U.T @ S @ U)
    root = np.sqrt(np.maximum(values, 0.0))
    which = root < 1.0 / LOOSE
    if not with_gauge:
        which &= root > UNTOLD
    basis = sparse_basis(moves @ V[:, which])
    stds = 1.0 / np.maximum(root[which], UNTOLD)
    return (
        list(zip(basis.T, stds.tolist(), strict=True)),
        U @ V[:, which],
        moves @ V[:, which] / size[:, None],
    )


def _joined(words: list[str]) -> str:
    return words[0] if len(words) == 1 else f"{words[0]} with {', '.join(words[1:])}"
