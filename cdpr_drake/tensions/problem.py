"""Problem and solution of a tension distribution, and the check of tensions against a problem."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Any

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.summaries import Summarized
from cdpr_drake.tensions.quadratic_program_kernel import RANK_TOLERANCE

if TYPE_CHECKING:
    from cdpr_drake.numerics.own_terms import ProgramReport

RESIDUAL_TOLERANCE = 1e-9
"""Largest residual of feasible tensions, see `TensionProblem.residual`."""

VERDICT_ROUNDING = 1e-12
"""Distance to a bound that counts as on it, relative to the largest bound (or 1 N)."""

LEAST_FORCE_SHARE = 1e-6
"""Least scale of a residual, relative to what the cables can do: where all tensions are zero there
is nothing but rounding."""

ENDLESS = 1e4
"""Tensions without an upper limit are looked for up to so many times a scale of the problem."""


def read_only(array: Array) -> Array:
    """A view of an array that cannot be written to."""
    view = array.view()
    view.flags.writeable = False
    return view


def writable(array: Array) -> Array:
    """The array behind a `read_only` one, as compiled kernels take it; or the array itself."""
    return array if array.flags.writeable else np.asarray(array.base)


class TensionStatus(StrEnum):
    """Verdict on tensions.

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
        reference: Preferred tensions, shape (m,) [N]; None where a method needs none.
        row_scale: Unit of each row of an unbalanced wrench, above 0, shape (n,): a length [m] for
            moments, 1 for forces; None: ones. Used only by methods that relax, where nothing is
            feasible.
        scale_of_rows: `row_scale`, or ones, shape (n,).

    Raises:
        TensionProblemError: Shapes that do not fit, numbers that are complex or not finite (`upper`
            may be infinite), negative or crossed bounds, fewer cables than degrees of freedom, or a
            singular W.
    """

    W: Array
    wrench: Array
    lower: Array
    upper: Array
    reference: Array | None = None
    row_scale: Array | None = None
    scale_of_rows: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Copies all arrays, which are read-only from then on, and checks them."""
        names = ("W", "wrench", "lower", "upper", "reference", "row_scale")
        numbers = checked_numbers(
            {name: getattr(self, name) for name in names}, "(n, m)", endless=True
        )
        for name, value in numbers.items():
            object.__setattr__(self, name, read_only(value.copy()))
        n = len(self.wrench)
        scale = self.row_scale if self.row_scale is not None else read_only(np.ones(n))
        object.__setattr__(self, "scale_of_rows", scale)
        singular = np.linalg.svd(self.W, compute_uv=False)
        rank = int(np.sum(singular > RANK_TOLERANCE * max(singular[0], 1e-300))) if n else 0
        if rank < n:
            raise TensionProblemError(f"W: found rank {rank}; accepted: {n}, full rank")

    @property
    def redundancy(self) -> int:
        """r = m - n, number of cables minus degrees of freedom."""
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
        """|W t + w| relative to |w| plus the forces of the cables [-]; tensions, shape (m,) [N]."""
        # With w = 0 (a planar robot, a hovering point) the forces of the cables are the scale.
        share = np.abs(self.W)
        forces = float(np.linalg.norm(share @ np.abs(tensions)))
        capacity = float(np.linalg.norm(share @ self.finite_upper()))
        scale = max(float(np.linalg.norm(self.wrench)) + forces, LEAST_FORCE_SHARE * capacity)
        return float(np.linalg.norm(self.W @ tensions + self.wrench)) / max(scale, 1e-300)


def checked_numbers(
    numbers: dict[str, Any], axes: str, *, endless: bool = False
) -> dict[str, Array]:
    """Arrays of a problem, or of many with one more axis of W and wrench; refuses what cannot be.

    Args:
        numbers: By name, W first, wrenches second; None is left out.
        axes: Shape of W in words, "(n, m)" or "(k, n, m)".
        endless: True if upper tensions may be infinite.

    Raises:
        TensionProblemError: As `TensionProblem`, except for the rank.
    """
    arrays: dict[str, Array] = {}
    for name, value in numbers.items():
        if value is not None:
            try:
                if np.iscomplexobj(value) and np.any(np.imag(value)):
                    raise TensionProblemError(f"{name}: found complex numbers; accepted: real ones")
                array = np.ascontiguousarray(np.real(value), float)
            except (TypeError, ValueError) as error:
                raise TensionProblemError(
                    f"{name}: found no array of numbers; accepted: one"
                ) from error
            # Kernels at an address take nothing read-only.
            arrays[name] = array if array.flags.writeable else array.copy()
    (name, W), (second, _) = list(arrays.items())[:2]
    if W.ndim != axes.count(",") + 1:
        raise TensionProblemError(f"{name}: found shape {W.shape}; accepted: {axes}")
    n, m = W.shape[-2:]
    shapes = {second: W.shape[:-1], "row_scale": (n,)}
    for name, value in list(arrays.items())[1:]:
        shape = shapes.get(name, (m,))
        if value.shape != shape:
            raise TensionProblemError(f"{name}: found shape {value.shape}; accepted: {shape}")
    for name, value in arrays.items():
        limited = value[~np.isposinf(value)] if endless and name == "upper" else value
        if not np.all(np.isfinite(limited)):
            raise TensionProblemError(f"{name}: found {_words(value)}; accepted: finite numbers")
    lower, upper = arrays["lower"], arrays["upper"]
    if np.any(lower < 0.0):
        raise TensionProblemError(f"lower: found {_words(lower)}; accepted: >= 0 [N]")
    if np.any(lower > upper):
        raise TensionProblemError(
            f"upper: found {_words(upper)}, below lower {_words(lower)}; accepted: lower <= upper "
            "[N]"
        )
    if "row_scale" in arrays and np.any(arrays["row_scale"] <= 0.0):
        words = _words(arrays["row_scale"])
        raise TensionProblemError(f"row_scale: found {words}; accepted: above 0 [m, -]")
    if n > m:
        raise TensionProblemError(
            f"W: found {m} cables for {n} degrees of freedom; accepted: at least {n} cables"
        )
    return arrays


def _words(values: Array) -> str:
    words = np.array2string(values, precision=4, max_line_width=10_000, threshold=12)
    return words.replace("\n", " ")


@dataclass(frozen=True, repr=False)
class TensionSolution(Summarized):
    """Answer of a method.

    Attributes:
        method: Name of the method.
        status: Verdict.
        tensions: Shape (m,) [N]. FEASIBLE: the answer. NOT_FOUND: the last iterate, out of the
            bounds or off balance. INFEASIBLE: NaN, except for a method that relaxes.
        residual: |W t + w| relative to the forces at work; NaN where there are no tensions.
        active: -1 where a tension is on its lower bound, 1 on its upper, else 0, shape (m,).
        slack: Unbalanced wrench, W t + w, shape (n,) [N m, N].
        program: How a `TensionProgram` with own terms was solved; None for a kernel.
    """

    method: str
    status: TensionStatus
    tensions: Array
    residual: float
    active: np.ndarray
    slack: Array
    program: ProgramReport | None = None

    def as_dict(self) -> dict[str, Any]:
        """Content for JSON; NaN becomes null."""
        finite = np.all(np.isfinite(self.tensions))
        content: dict[str, Any] = {
            "method": self.method,
            "status": str(self.status),
            "tensions_n": self.tensions.tolist() if finite else None,
            "residual": self.residual if finite else None,
            "active_bounds": self.active.tolist(),
            "slack_wrench": self.slack.tolist() if finite else None,
        }
        if self.program is not None:
            content["program"] = self.program.as_dict()
        return content

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """Title and rows for people; a star marks a tension on a bound."""
        words = (
            f"{t:.2f}{'*' if bound else ''}"
            for t, bound in zip(self.tensions, self.active, strict=True)
        )
        rows = [("tensions [N]", ", ".join(words)), ("residual", f"{self.residual:.2g}")]
        if self.program is not None:
            rows += self.program.rows()
        return f"Tensions by {self.method}: {self.status}", rows


def refuse(problem: TensionProblem, method: str) -> TensionSolution:
    """Solution of a problem without any tensions: NaN."""
    n, m = problem.W.shape
    nan, active = np.full(m, np.nan), np.zeros(m, int)
    return TensionSolution(
        method, TensionStatus.INFEASIBLE, nan, np.nan, active, np.full(n, np.nan)
    )


@njit(cache=True)
def balance(W: Array, w: Array, lower: Array, upper: Array, t: Array) -> tuple[bool, float]:
    """Whether t is within the bounds, and its `TensionProblem.residual`.

    Tensions that are out by rounding are put on their bounds. NaN is out of bounds.
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
    forces, capacity, wrench, error = 0.0, 0.0, 0.0, 0.0
    for j in range(n):
        force, size, largest_size = 0.0, 0.0, 0.0
        for i in range(m):
            force += W[j, i] * t[i]
            size += abs(W[j, i]) * abs(t[i])
            largest_size += abs(W[j, i]) * upper[i]
        forces += size * size
        capacity += largest_size * largest_size
        wrench += w[j] * w[j]
        error += (force + w[j]) * (force + w[j])
    scale = max(np.sqrt(wrench) + np.sqrt(forces), LEAST_FORCE_SHARE * np.sqrt(capacity))
    return inside, np.sqrt(error) / max(scale, 1e-300)


@njit(cache=True)
def describe(
    W: Array, w: Array, lower: Array, upper: Array, t: Array, active: np.ndarray, slack: Array
) -> None:
    """Writes `active` and `slack` of a `TensionSolution`."""
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
