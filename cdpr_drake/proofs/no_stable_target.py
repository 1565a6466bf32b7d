"""Where no target, view or place of the camera makes a servo stable: an outer bound of workspaces.

As long as what is seen of the object is not wrong, the interaction matrix is the same on both sides
of the criterion, Pi = L X L^-1, and with the camera's place known X is similar to A^+ A_hat. So Pi
has the eigenvalues of A^+ A_hat, whatever the camera sees, wants and where it is mounted, under
PBVS, 2 1/2 D and IBVS. Pi + Pi' > 0 implies that all of them have positive real parts (Lyapunov): a
pose at which one perturbation within the bounds makes a real part zero or negative lies outside of
the workspace of every target. The converse does not hold.

Source: servoing thesis (3.1), (3.27).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.rotation_kernel import rotations_of_quaternions
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds

FLOOR = 1e-9
"""Real parts below this count as not positive [-]; rounding is smaller by orders of magnitude."""


@dataclass(frozen=True, eq=False)
class ModelError:
    """What is wrong with the model at N poses.

    Attributes:
        turn: Rotation vectors of the platform in P, shape (N, 3) [rad].
        shift: Shifts of the platform in W, shape (N, 3) [m].
        exits: Shifts of the exit points in W, shape (N, m, 3) [m].
        anchors: Shifts of the anchor points in P, shape (N, m, 3) [m].
    """

    turn: Array
    shift: Array
    exits: Array
    anchors: Array

    def of(self, some: np.ndarray) -> ModelError:
        """Those of some poses."""
        return ModelError(self.turn[some], self.shift[some], self.exits[some], self.anchors[some])

    def put(self, some: np.ndarray, other: ModelError) -> None:
        """Takes those of some poses over."""
        for name in ("turn", "shift", "exits", "anchors"):
            getattr(self, name)[some] = getattr(other, name)


def stable_target_exists(
    cables: CableSet,
    bounds: PerturbationBounds,
    poses: Array,
    draws: int = 10,
    steps: int = 12,
    seed: int = 0,
) -> np.ndarray:
    """Poses at which no perturbation was found that excludes every target, shape (N,) bool.

    Perturbations of platform and points alone are tried, each point in its own ball: what
    `bounds` say of the camera, of the object and of directions is not used. Random ones come
    first, then, from the worst of them, steps to where the smallest real part falls most.

    Args:
        cables: Without pulleys.
        bounds: What limits the perturbations.
        poses: Platform poses, rows of quaternion (w, x, y, z) and position [m], shape (N, 7).
        draws: Random perturbations that are tried.
        steps: Steps of the search.
        seed: Start of the random numbers.
    """
    poses = np.array(poses, float, ndmin=2)
    unit = poses[:, :4] / np.linalg.norm(poses[:, :4], axis=1, keepdims=True)
    R, p = rotations_of_quaternions(unit), poses[:, 4:]
    A, B = cables.p_WA.T, cables.p_PB.T
    count, m = len(poses), len(A)
    true = np.asarray(np.linalg.pinv(_jacobians(R, p, A, B, _nothing(count, m))), float)
    rng = np.random.default_rng(seed)
    least = np.full(count, np.inf)
    worst = _nothing(count, m)
    for number in range(draws + steps):
        left = np.flatnonzero(least > FLOOR)
        if not left.size:
            break
        if number < draws:
            trial = _drawn(rng, bounds, left.size, m)  # the same at every pose
        else:
            trial = _steepest(bounds, R[left], p[left], A, B, true=true[left], at=worst.of(left))
        found = _smallest(true[left] @ _jacobians(R[left], p[left], A, B, trial))
        # A step is taken where it is worse for the servo; others start from there again.
        better = found < least[left]
        least[left[better]] = found[better]
        worst.put(left[better], trial.of(better))
    return least > FLOOR


def _nothing(count: int, m: int) -> ModelError:
    flat, points = (count, 3), (count, m, 3)
    return ModelError(np.zeros(flat), np.zeros(flat), np.zeros(points), np.zeros(points))


def _drawn(rng: np.random.Generator, bounds: PerturbationBounds, count: int, m: int) -> ModelError:
    """One random error of full magnitude, for all poses."""
    turn, shift = _unit(rng.normal(size=(2, 3)))
    exits, anchors = _unit(rng.normal(size=(2, m, 3)))
    parts = (bounds.d_theta_bp * turn, bounds.r_bp * shift, bounds.r_A * exits,
             bounds.r_B * anchors)  # fmt: skip
    return ModelError(*(np.broadcast_to(part, (count, *part.shape)) for part in parts))


def _unit(vectors: Array) -> Array:
    norms = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(norms > 0.0, norms, 1.0))


def _turns(vectors: Array) -> Array:
    """Rotation matrices of rotation vectors, shape (N, 3, 3)."""
    angle = np.linalg.norm(vectors, axis=1)
    half = np.column_stack([np.cos(angle / 2.0), _unit(vectors) * np.sin(angle / 2.0)[:, None]])
    return rotations_of_quaternions(half)


def _jacobians(R: Array, p: Array, A: Array, B: Array, error: ModelError) -> Array:
    """Cable Jacobians in P up to their sign, rows (b x u, u), shape (N, m, 6)."""
    R = R @ _turns(error.turn)
    away = A + error.exits - (p + error.shift)[:, None, :]
    b = B + error.anchors
    u = _unit(np.einsum("nji,nkj->nki", R, away) - b)
    return np.concatenate([np.cross(b, u), u], axis=2)


def _smallest(X: Array) -> Array:
    """Smallest real parts of eigenvalues, shape (N,)."""
    return np.asarray(np.linalg.eigvals(X).real.min(axis=1))


def _steepest(
    bounds: PerturbationBounds,
    R: Array,
    p: Array,
    A: Array,
    B: Array,
    *,
    true: Array,
    at: ModelError,
) -> ModelError:
    """Errors within the bounds towards which the smallest real part falls most."""
    values, vectors = np.linalg.eig(true @ _jacobians(R, p, A, B, at))
    which = np.argmin(values.real, axis=1)
    rows = np.arange(len(values))
    x = vectors[rows, :, which]
    # The rows of the inverse are left eigenvectors with y x = 1.
    with np.errstate(all="ignore"):
        y = np.linalg.pinv(vectors)[rows, which]
    weight = np.einsum("ni,nij->nj", y, true)
    turned = R @ _turns(at.turn)
    away = np.einsum("nji,nkj->nki", turned, A + at.exits - (p + at.shift)[:, None, :])
    b = B + at.anchors
    length = np.linalg.norm(away - b, axis=2, keepdims=True)
    u = (away - b) / length
    # A row times x is u . s with s = v + w x b, so its slope over u is s, over b also w x u.
    w, v = x[:, None, :3], x[:, None, 3:]
    s = v + np.cross(w, b)
    pull = (s - np.sum(s * u, axis=2, keepdims=True) * u) / length
    scale = weight[:, :, None]
    slope_away = (scale * pull).real
    slope_b = (scale * (np.cross(u, w) - pull)).real
    in_world = np.einsum("nij,nkj->nki", turned, slope_away)
    turn = np.sum(np.cross(slope_away, away), axis=1)
    return ModelError(
        -bounds.d_theta_bp * _unit(turn),
        bounds.r_bp * _unit(in_world.sum(axis=1)),
        -bounds.r_A * _unit(in_world),
        -bounds.r_B * _unit(slope_b),
    )
