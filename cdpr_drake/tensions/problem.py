"""What a tension distribution is asked and what it answers, as plain data."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Any

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.summaries import Summarized
from cdpr_drake.tensions.null_space_kernel import RANK_TOLERANCE

if TYPE_CHECKING:
    from cdpr_drake.numerics.own_terms import ProgramReport

RESIDUAL_TOLERANCE = 1e-9
"""Tensions are feasible if |W t + w| is at most this, relative to |w| plus the cables' share."""


VERDICT_ROUNDING = 1e-12
"""A tension beyond its bound by less, relative to the largest bound (or 1 N), is on it."""

LEAST_FORCE_SHARE = 1e-6
"""Forces below this, relative to what the cables can do, are not what a residual is relative to:
where all tensions are zero, rounding is all there is."""

ENDLESS = 1e4
"""Tensions without an upper limit are looked for up to so many times a scale of the problem."""

NUMBERS = ("W", "wrench", "lower", "upper", "reference", "row_scale")
"""The arrays of a problem."""


def read_only(array: Array) -> Array:
    """A view of an array that cannot be written to."""
    view = array.view()
    view.flags.writeable = False
    return view


def writable(array: Array) -> Array:
    """The array behind a `read_only` one, as compiled kernels take it; or the array itself."""
    return array if array.flags.writeable else np.asarray(array.base)


class TensionStatus(StrEnum):
    """The verdict on tensions.

    FEASIBLE: they balance the wrench within the bounds. INFEASIBLE: no tensions do; a proof.
    NOT_FOUND: the method found none although there are some.
    """

    FEASIBLE = "feasible"
    INFEASIBLE = "infeasible"
    NOT_FOUND = "missed"


@dataclass(frozen=True)
class TensionProblem:
    """Which tensions t balance the wrench w, W t + w = 0, with lower <= t <= upper?

    The arrays are read-only copies of those that are given.

    Attributes:
        W: Wrench matrix, shape (n, m), n <= m, full rank; rows (moment [m], force [-]).
        wrench: External wrench w on the platform about Po, shape (n,) [N m, N].
        lower: Smallest tensions, shape (m,), not negative [N].
        upper: Largest tensions, shape (m,) [N]; infinite where there is no limit, which methods
            that aim at the middle of the bounds do not take.
        reference: Wanted tensions, shape (m,) [N]; None where a method needs none.
        row_scale: What an unbalanced wrench is divided by, row by row, to say how large it is,
            above 0, shape (n,): a length [m] for moments, 1 for forces; None: ones. Only methods
            that relax ask, where nothing is feasible.
        nothing_wanted: Zeros, what methods get that need no reference, shape (m,) [N].
        scale_of_rows: `row_scale`, or ones, shape (n,).

    Raises:
        TensionProblemError: Sizes that do not fit, numbers that are complex or not finite (`upper`
            may be infinite), negative or crossed bounds, fewer cables than degrees of freedom, or a
            singular W.
    """

    W: Array
    wrench: Array
    lower: Array
    upper: Array
    reference: Array | None = None
    row_scale: Array | None = None
    nothing_wanted: Array = field(init=False, repr=False, compare=False)
    scale_of_rows: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Copies all arrays, which are read-only from then on, and checks them."""
        for name in NUMBERS:
            value = getattr(self, name)
            if value is None:
                continue
            try:
                if np.iscomplexobj(value) and np.any(np.imag(value)):
                    raise TensionProblemError(f"{name}: found complex numbers; accepted: real ones")
                converted = np.array(np.real(value), dtype=float, order="C", ndmin=1)
            except (TypeError, ValueError) as problem:
                raise TensionProblemError(
                    f"{name}: found no array of numbers; accepted: one"
                ) from problem
            object.__setattr__(self, name, read_only(converted))
        if self.W.ndim != 2:
            raise TensionProblemError(f"W: found shape {self.W.shape}; accepted: (n, m)")
        n, m = self.W.shape
        for name, size in zip(NUMBERS[1:], (n, m, m, m, n), strict=True):
            value = getattr(self, name)
            if value is not None and value.shape != (size,):
                raise TensionProblemError(f"{name}: found shape {value.shape}; accepted: ({size},)")
        for name in NUMBERS:
            value = getattr(self, name)
            if value is not None and name == "upper":  # infinite: no limit
                value = np.where(np.isposinf(value), 0.0, value)
            if value is not None and not np.all(np.isfinite(value)):
                raise TensionProblemError(
                    f"{name}: found {_words(value)}; accepted: finite numbers"
                )
        if np.any(self.lower < 0.0):
            raise TensionProblemError(f"lower: found {_words(self.lower)}; accepted: >= 0 [N]")
        if np.any(self.lower > self.upper):
            raise TensionProblemError(
                f"upper: found {_words(self.upper)}, below lower {_words(self.lower)}; accepted: "
                "lower <= upper [N]"
            )
        if self.row_scale is not None and np.any(self.row_scale <= 0.0):
            raise TensionProblemError(
                f"row_scale: found {_words(self.row_scale)}; accepted: above 0 [m, -]"
            )
        if n > m:
            raise TensionProblemError(
                f"W: found {m} cables for {n} degrees of freedom; accepted: at least {n} cables"
            )
        singular = np.linalg.svd(self.W, compute_uv=False)
        rank = int(np.sum(singular > RANK_TOLERANCE * max(singular[0], 1e-300))) if n else 0
        if rank < n:
            raise TensionProblemError(f"W: found rank {rank}; accepted: {n}, full rank")
        object.__setattr__(self, "nothing_wanted", read_only(np.zeros(m)))
        scale = read_only(np.ones(n)) if self.row_scale is None else self.row_scale
        object.__setattr__(self, "scale_of_rows", scale)

    @property
    def redundancy(self) -> int:
        """r = m - n, cables more than degrees of freedom."""
        return int(self.W.shape[1] - self.W.shape[0])

    def finite_upper(self) -> Array:
        """`upper`, with a number far above what balances the wrench where there is no limit.

        That is `lower` plus `ENDLESS` times the load, |w| plus what the other bounds pull, over the
        smallest singular value of W with its rows divided by `scale_of_rows`, shape (m,) [N].
        """
        endless = np.isposinf(self.upper)
        if not np.any(endless):
            return writable(self.upper)
        held = np.where(endless, self.lower, self.upper)
        scale = self.scale_of_rows
        W, w = self.W / scale[:, np.newaxis], self.wrench / scale
        singular = np.linalg.svd(W, compute_uv=False)[-1]
        load = float(np.linalg.norm(w) + np.linalg.norm(W) * np.linalg.norm(held))
        return np.where(endless, held + ENDLESS * max(load / singular, 1.0), self.upper)

    def residual(self, tensions: Array) -> float:
        """|W t + w| relative to |w| plus the forces of the cables, shape (m,) [N] in, [-] out."""
        # With w = 0 (a planar robot, a hovering point) the cables' own forces are the measure.
        share = np.abs(self.W)
        own = float(np.linalg.norm(share @ np.abs(tensions)))
        able = float(np.linalg.norm(share @ self.finite_upper()))
        scale = max(float(np.linalg.norm(self.wrench)) + own, LEAST_FORCE_SHARE * able)
        return float(np.linalg.norm(self.W @ tensions + self.wrench)) / max(scale, 1e-300)


@dataclass(frozen=True, repr=False)
class TensionSolution(Summarized):
    """The answer of a method.

    Attributes:
        method: Name of the method.
        status: The verdict.
        tensions: Shape (m,) [N]. FEASIBLE: the answer. NOT_FOUND: what the method came to, outside
            the bounds or off balance. INFEASIBLE: NaN, except for a method that relaxes.
        residual: |W t + w| relative to the forces at work; NaN where there are no tensions.
        active: -1 where a tension is on its lower bound, 1 on its upper, else 0, shape (m,).
        slack: Wrench that the tensions leave unbalanced, W t + w, shape (n,) [N m, N].
        program: Of a `TensionProgram` with own terms, how it was solved; None: by a kernel.
    """

    method: str
    status: TensionStatus
    tensions: Array
    residual: float
    active: np.ndarray
    slack: Array
    program: ProgramReport | None = None

    def as_dict(self) -> dict[str, Any]:
        """For JSON; tensions that are not there are null."""
        finite = np.all(np.isfinite(self.tensions))
        found: dict[str, Any] = {
            "method": self.method,
            "status": str(self.status),
            "tensions_n": self.tensions.tolist() if finite else None,
            "residual": self.residual if finite else None,
            "active_bounds": self.active.tolist(),
            "slack_wrench": self.slack.tolist() if finite else None,
        }
        if self.program is not None:
            found["program"] = self.program.as_dict()
        return found

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself; tensions on a bound have a star."""
        words = (
            f"{t:.2f}{'*' if bound else ''}"
            for t, bound in zip(self.tensions, self.active, strict=True)
        )
        rows = [("tensions [N]", ", ".join(words)), ("residual", f"{self.residual:.2g}")]
        if self.program is not None:
            rows += self.program.rows()
        return f"Tensions by {self.method}: {self.status}", rows


@njit(cache=True)
def balance(W: Array, w: Array, lower: Array, upper: Array, t: Array) -> tuple[bool, float]:
    """Whether tensions, shape (m,) [N], are within bounds, and `TensionProblem.residual` of them.

    Those that are out by rounding are put on their bounds. NaN is out of bounds.
    """
    n, m = W.shape
    largest = 1.0
    for i in range(m):
        largest = max(largest, upper[i])
    rounding = VERDICT_ROUNDING * largest
    inside = True
    for i in range(m):
        inside = inside and t[i] >= lower[i] - rounding and t[i] <= upper[i] + rounding
    if inside:
        for i in range(m):
            t[i] = min(max(t[i], lower[i]), upper[i])
    own, able, wrench, off = 0.0, 0.0, 0.0, 0.0
    for j in range(n):
        force, its, possible = 0.0, 0.0, 0.0
        for i in range(m):
            force += W[j, i] * t[i]
            its += abs(W[j, i]) * abs(t[i])
            possible += abs(W[j, i]) * upper[i]
        own += its * its
        able += possible * possible
        wrench += w[j] * w[j]
        off += (force + w[j]) * (force + w[j])
    scale = max(np.sqrt(wrench) + np.sqrt(own), LEAST_FORCE_SHARE * np.sqrt(able))
    return inside, np.sqrt(off) / max(scale, 1e-300)


@njit(cache=True)
def describe(
    W: Array, w: Array, lower: Array, upper: Array, t: Array, active: np.ndarray, slack: Array
) -> None:
    """Writes what `TensionSolution` says of tensions, shape (m,) [N]: `active` and `slack`."""
    n, m = W.shape
    largest = 1.0
    for i in range(m):
        largest = max(largest, upper[i])
    rounding = VERDICT_ROUNDING * largest
    for i in range(m):
        active[i] = 0
        if t[i] <= lower[i] + rounding:
            active[i] = -1
        if t[i] >= upper[i] - rounding:
            active[i] = 1
    for j in range(n):
        slack[j] = w[j]
        for i in range(m):
            slack[j] += W[j, i] * t[i]


def refuse(problem: TensionProblem, method: str) -> TensionSolution:
    """The solution of a problem that has none: NaN."""
    n, m = problem.W.shape
    nan = np.full(m, np.nan)
    return TensionSolution(
        method, TensionStatus.INFEASIBLE, nan, np.nan, np.zeros(m, int), np.full(n, np.nan)
    )


def _words(values: Array) -> str:
    return np.array2string(values, precision=4, max_line_width=10_000, threshold=12).replace(
        "\n", " "
    )
