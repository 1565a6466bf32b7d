"""Small linear algebra in kernels: elimination, least squares, smallest eigenpair, copies.

`eliminate` and `substitute` solve small linear systems, `least_squares` those of limited rank;
`least_squares` alone allocates.

Source: Golub and Van Loan, Matrix Computations, 3.4, 8.3 and 8.4.
"""

from __future__ import annotations

import numpy as np
from numba import njit, types

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.shared_kernels import MATRIX, VECTOR, shared

SHIFT = 1e-7
"""How far below the eigenvalue the factor for its vector is shifted, relative to the largest
element or 1: far above rounding, so that the factor exists."""

LEAST_SHARE = 1e-9
"""Singular values below this share of the largest count as zero."""

SURELY = 0.5
"""Part of the largest condition number up to which bounds of it decide; above they may be wrong by
rounding, which at that condition is a millionth."""

NEGLIGIBLE = 1e-280
"""A column whose squares sum to less is zero already; reflecting it would only lose digits."""


@njit(cache=True, error_model="numpy")
def eliminate(A: Array, n: int, pivots: Array) -> None:
    """Overwrites `A[:n, :n]` by its triangular factors, for `substitute`.

    Gauss' elimination with row pivots. Source: Golub and Van Loan, 3.4.

    Args:
        A: Matrix, shape (n, n) or larger; a singular one leaves infinite or NaN numbers.
        n: Its size.
        pivots: Where the rows' exchanges are written, shape (n,), whole numbers as floats.
    """
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(A[i, k]) > abs(A[best, k]):
                best = i
        pivots[k] = best
        if best != k:
            for j in range(n):
                A[k, j], A[best, j] = A[best, j], A[k, j]
        for i in range(k + 1, n):
            A[i, k] /= A[k, k]
            for j in range(k + 1, n):
                A[i, j] -= A[i, k] * A[k, j]


@njit(cache=True, error_model="numpy")
def substitute(A: Array, n: int, pivots: Array, x: Array) -> None:
    """Overwrites a right hand side, `x[:n]`, by the solution; other arguments from `eliminate`."""
    for k in range(n):
        best = int(pivots[k])
        x[k], x[best] = x[best], x[k]
    for i in range(n):
        for j in range(i):
            x[i] -= A[i, j] * x[j]
    for i in range(n - 1, -1, -1):
        for j in range(i + 1, n):
            x[i] -= A[i, j] * x[j]
        x[i] /= A[i, i]


@njit(cache=True, error_model="numpy")
def _by_reflections(L: Array, rate: Array, v: Array) -> bool:
    """v of `least_squares` where all columns of L surely count, by Householder's reflections.

    Frobenius' norms of the triangle and of its inverse bound the largest singular value from above
    and the smallest from below. Source: Golub and Van Loan, 5.2 and 2.3.

    Returns:
        Whether they do; if not, or if a number is not finite, v is not what is sought.
    """
    n, k = L.shape
    A, scale, inverse = np.empty((n, k + 1)), 0.0, 0.0
    for i in range(n):
        for j in range(k):
            A[i, j] = L[i, j]
            scale += L[i, j] * L[i, j]
        A[i, k] = rate[i]
    for c in range(k):
        square = 0.0
        for i in range(c, n):
            square += A[i, c] * A[i, c]
        size = np.sqrt(square) if A[c, c] <= 0.0 else -np.sqrt(square)
        head = A[c, c] - size
        half = -size * head  # a half of the square of what is reflected at
        for j in range(c + 1, k + 1):
            share = head * A[c, j]
            for i in range(c + 1, n):
                share += A[i, c] * A[i, j]
            share /= half
            A[c, j] -= share * head
            for i in range(c + 1, n):
                A[i, j] -= share * A[i, c]
        A[c, c] = size
    column = np.empty(k)
    for c in range(k - 1, -1, -1):
        v[c] = A[c, k]
        for j in range(c + 1, k):
            v[c] -= A[c, j] * v[j]
        v[c] /= A[c, c]
    for c in range(k):  # column c of the inverse
        column[c] = 1.0 / A[c, c]
        inverse += column[c] * column[c]
        for i in range(c - 1, -1, -1):
            column[i] = 0.0
            for j in range(i + 1, c + 1):
                column[i] -= A[i, j] * column[j]
            column[i] /= A[i, i]
            inverse += column[i] * column[i]
    return bool(np.sqrt(scale) * np.sqrt(inverse) * LEAST_SHARE < SURELY)


@njit(cache=True)
def least_squares(L: Array, rate: Array, rank: int) -> tuple[Array, Array]:
    """v of least norm that brings L @ v nearest to a rate, and the projector on L's null space.

    Singular values by LAPACK decide what counts, but for matrices of which all surely does: those
    are solved by reflections, in a tenth of the time. Allocates what it returns and what these
    need.

    Args:
        L: Interaction matrix, shape (n, k).
        rate: Wanted rate of the features, shape (n,).
        rank: Singular values beyond this many, or below `LEAST_SHARE` of the largest, count as
            zero: where features leave a motion free, image noise must not move it.

    Returns:
        v, shape (k,), and 1 - L^+ L, shape (k, k).
    """
    n, k = L.shape
    v = np.zeros(k)
    if rank >= k and n >= k and _by_reflections(L, rate, v):
        return v, np.zeros((k, k))
    v[:] = 0.0
    U, S, Vt = np.linalg.svd(L, full_matrices=False)
    free = np.eye(k)
    for i in range(min(rank, S.shape[0])):
        if S[i] <= LEAST_SHARE * S[0]:
            break
        share = 0.0
        for j in range(n):
            share += U[j, i] * rate[j]
        share /= S[i]
        for a in range(k):
            v[a] += Vt[i, a] * share
            for b in range(k):
                free[a, b] -= Vt[i, a] * Vt[i, b]
    return v, free


@shared(types.float64(MATRIX, MATRIX))
@njit(cache=True, error_model="numpy")
def smallest_eigenvalue(S: Array, T: Array) -> float:
    """Smallest eigenvalue of S; minus infinity where a number is not finite.

    Householder reflections make the matrix tridiagonal; Sturm's sign count brackets the eigenvalue,
    and bisection closes the bracket to rounding. Source: Golub and Van Loan, 8.3 and 8.4.

    Args:
        S: Symmetric, shape (n, n).
        T: Work space, shape (n, n).
    """
    n = S.shape[0]
    for i in range(n):
        for j in range(n):
            T[i, j] = S[i, j]
            if not np.isfinite(S[i, j]):
                return -np.inf
    for k in range(n - 2):  # reflections leave row k with two elements; v lies in column k
        square = 0.0
        for i in range(k + 1, n):
            square += T[i, k] * T[i, k]
        length = np.sqrt(square)
        if square < NEGLIGIBLE:
            continue
        if T[k + 1, k] > 0.0:
            length = -length
        first = T[k + 1, k] - length
        below = square - T[k + 1, k] * length  # v'v / 2
        if below == 0.0:
            continue
        T[k + 1, k] = first
        share = 0.0
        for i in range(k + 1, n):  # p = T v / below, in row k
            x = 0.0
            for j in range(k + 1, n):
                x += T[i, j] * T[j, k]
            T[k, i] = x / below
            share += T[k, i] * T[i, k]
        share /= 2.0 * below
        for i in range(k + 1, n):
            T[k, i] -= share * T[i, k]
        for i in range(k + 1, n):
            for j in range(k + 1, n):
                T[i, j] -= T[i, k] * T[k, j] + T[k, i] * T[j, k]
        T[k + 1, k] = length
    low, high = np.inf, -np.inf
    for i in range(n):  # Gershgorin's circles
        reach = 0.0
        if i > 0:
            reach += abs(T[i, i - 1])
        if i < n - 1:
            reach += abs(T[i + 1, i])
        low, high = min(low, T[i, i] - reach), max(high, T[i, i] + reach)
    size = max(abs(low), abs(high))
    high = min(high, T[0, 0])
    for i in range(n):
        high = min(high, T[i, i])  # the smallest eigenvalue is below every diagonal element
    tiny = 1e-300 + 1e-30 * size
    while high - low > 4e-16 * size:
        middle = 0.5 * (low + high)
        if middle <= low or middle >= high:
            break
        x, below_middle = T[0, 0] - middle, False
        for i in range(n):
            if i > 0:
                if abs(x) < tiny:
                    x = tiny
                x = T[i, i] - middle - T[i, i - 1] * T[i, i - 1] / x
            if x < 0.0:
                below_middle = True
                break
        if below_middle:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


@shared(types.float64(*[MATRIX] * 3, VECTOR))
@njit(cache=True, error_model="numpy")
def smallest_eigenpair(S: Array, T: Array, F: Array, v: Array) -> float:
    """Smallest eigenvalue of S, as `smallest_eigenvalue`; v <- a unit vector of it.

    The vector comes by inverse iteration with a Cholesky factor shifted below the eigenvalue. For
    matrices of six rows all this takes about a tenth of LAPACK's time.

    Args:
        S: Symmetric, shape (n, n).
        T: Work space, shape (n, n).
        F: Work space, shape (n, n).
        v: Output, shape (n,).
    """
    n = S.shape[0]
    value = smallest_eigenvalue(S, T)
    if value == -np.inf:
        return value
    size = 1.0
    for i in range(n):
        for j in range(n):
            size = max(size, abs(S[i, j]))
    shift = SHIFT * size
    while not factor(S, value - shift, F):
        shift *= 10.0
    for i in range(n):
        v[i] = 1.0 + 0.1 * i * i - 0.3 * i  # any vector that symmetries are not orthogonal to
    for _ in range(3):
        for i in range(n):
            x = v[i]
            for j in range(i):
                x -= F[i, j] * v[j]
            v[i] = x / F[i, i]
        for i in range(n - 1, -1, -1):
            x = v[i]
            for j in range(i + 1, n):
                x -= F[j, i] * v[j]
            v[i] = x / F[i, i]
        norm = 0.0
        for i in range(n):
            norm += v[i] * v[i]
        norm = np.sqrt(norm)
        for i in range(n):
            v[i] /= norm
    return value


@njit(cache=True, error_model="numpy")
def factor(S: Array, shift: float, F: Array) -> bool:
    """F <- lower Cholesky factor of S - shift I; False, and F unfinished, if not positive."""
    n = S.shape[0]
    for j in range(n):
        x = S[j, j] - shift
        for k in range(j):
            x -= F[j, k] * F[j, k]
        if not x > 0.0:
            return False
        x = np.sqrt(x)
        F[j, j] = x
        for i in range(j + 1, n):
            y = S[i, j]
            for k in range(j):
                y -= F[i, k] * F[j, k]
            F[i, j] = y / x
    return True


@njit(cache=True)
def copy_vector(a: Array, out: Array) -> None:
    """out <- a, both of shape (n,), as a loop.

    An assignment of one array to a slice of another compiles much more: messages about shapes that
    do not fit, and strings to write them with, in every kernel that is linked above it.
    """
    for i in range(a.shape[0]):
        out[i] = a[i]


@njit(cache=True)
def copy_matrix(a: Array, out: Array) -> None:
    """out <- a, both of shape (n, k), as loops, see `copy_vector`."""
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            out[i, j] = a[i, j]
