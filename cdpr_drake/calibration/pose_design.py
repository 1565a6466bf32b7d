"""Which poses tell most: D-optimal choice among candidates, greedy and then by exchange."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.elimination import LeastSquares, symmetric_solve
from cdpr_drake.calibration.stations import Point
from cdpr_drake.errors import CalibrationError

LEAST_GAIN = 1e-6
"""An exchange has to raise the logarithm of the determinant by as much."""

MOST_EXCHANGES = 10
"""Times that all chosen poses are tried to be exchanged."""

KNOWN = 1e-10
"""Directions of a pose's own unknowns below this share of the largest are not determined by it."""


def informing_rows(problem: LeastSquares, at: Point) -> Array:
    """What each pose tells of the parameters once its own unknowns are eliminated.

    Returns:
        Shape (k, rows, f), in typical sizes: information is the sum of rows' * rows.
    """
    _, A, B = problem.evaluate(at)
    U, s, _ = np.linalg.svd(B, full_matrices=False)
    U = U * (s > KNOWN * s[:, :1])[:, None, :]
    return np.asarray(A - U @ (np.swapaxes(U, 1, 2) @ A))


def choose_poses(
    rows: Array,
    count: int,
    known: Array,
    say: Callable[[int], None] = lambda done: None,
) -> tuple[npt.NDArray[np.intp], float]:
    """The poses whose measurements make the determinant of the information largest, nearly.

    Greedy, then every chosen pose is exchanged for a better one while there is one (Fedorov).

    Args:
        rows: What each candidate tells, shape (k, rows, f), see `informing_rows`.
        count: How many to choose.
        known: Information that is there already, priors included, shape (f, f), positive definite.
        say: Told how many are chosen.

    Returns:
        Numbers of the candidates in the order in which they were chosen, and the logarithm of the
        determinant of all information.

    Raises:
        CalibrationError: There are fewer candidates than poses asked for, or nothing is known.

    Source: Fedorov, Theory of optimal experiments, 1972.
    """
    candidates = len(rows)
    if not 0 < count <= candidates:
        raise CalibrationError(f"poses: found {count}; accepted: 1 to {candidates} candidates")
    information = known.copy()
    chosen: list[int] = []
    for _ in range(count):
        gain = _gains(rows, information)
        gain[chosen] = -np.inf
        best = int(np.argmax(gain))
        chosen.append(best)
        information = information + rows[best].T @ rows[best]
        say(len(chosen))
    for _ in range(MOST_EXCHANGES):
        better = False
        for place, one in enumerate(chosen):
            without = information - rows[one].T @ rows[one]
            gain = _gains(rows, without)
            now = gain[one]
            gain[chosen] = -np.inf
            best = int(np.argmax(gain))
            if gain[best] > now + LEAST_GAIN:
                chosen[place], better = best, True
                information = without + rows[best].T @ rows[best]
        if not better:
            break
    return np.array(chosen), float(np.linalg.slogdet(information)[1])


def expected_std(information: Array, typical: Array) -> Array:
    """Standard deviations that information tells, shape (f,), frames that nothing tells left out.

    Args:
        information: In typical sizes, shape (f, f).
        typical: By how much each parameter is usually unknown, shape (f,).
    """
    inverse = np.array([symmetric_solve(information, e) for e in np.eye(len(typical))])
    return np.asarray(np.sqrt(np.maximum(np.diag(inverse), 0.0)) * typical)


def _gains(rows: Array, information: Array) -> Array:
    """By how much each candidate raises the logarithm of the determinant, shape (k,)."""
    try:
        L = np.linalg.cholesky(information)
    except np.linalg.LinAlgError:
        raise CalibrationError(
            "poses: found nothing known of some parameters; accepted: a prior for each"
        ) from None
    half = np.linalg.solve(L[None], np.swapaxes(rows, 1, 2))
    inner = np.swapaxes(half, 1, 2) @ half + np.eye(rows.shape[1])
    return np.asarray(np.linalg.slogdet(inner)[1])
