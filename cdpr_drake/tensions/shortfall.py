"""How far an infeasible tension problem is from a feasible one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.tensions.optimal_kernel import least_slack
from cdpr_drake.tensions.problem import TensionProblem, writable

ACTIVE = 1e-9
"""A cable limits the shortfall where its multiplier, which all cables share to 1, is above this:
rounding of the linear program."""

NAMED = 0.05
"""Components of the missing wrench below this share of it are left out of the words."""


@dataclass(frozen=True, eq=False)
class Shortfall:
    """By how much tensions miss a wrench.

    Attributes:
        beyond: Least distance by which some tension must leave its bounds to balance the wrench,
            min over t with W t + w = 0 of max_i (lower_i - t_i, t_i - upper_i) [N].
        limits: Cables that set this distance, -1 below the lower bound, 1 above the upper, else 0,
            shape (m,).
        tensions: Tensions within the bounds that leave the least wrench unbalanced, shape (m,) [N].
        missing: That wrench W t + w, rows as in W, shape (n,) [N m, N].
        size: Its norm with each row divided by `TensionProblem.scale_of_rows` [N].
    """

    beyond: float
    limits: np.ndarray
    tensions: Array
    missing: Array
    size: float

    def as_dict(self, cables: Sequence[str]) -> dict[str, Any]:
        """For JSON, with the names of the m cables."""
        return {
            "beyond_bounds_n": self.beyond,
            "cables": [
                {"cable": name, "bound": "lower" if side < 0 else "upper"}
                for name, side in zip(cables, self.limits, strict=True)
                if side != 0
            ],
            "nearest_tensions_n": self.tensions.tolist(),
            "missing_wrench": self.missing.tolist(),
            "missing_n": self.size,
        }

    def rows(self, cables: Sequence[str], rows: Sequence[str]) -> list[tuple[str, str]]:
        """Labels and words of a table; names of the m cables and of the n rows of the wrench."""
        sides = {-1: "below", 1: "above"}
        limiting = ", ".join(
            f"{name} {sides[int(side)]}"
            for name, side in zip(cables, self.limits, strict=True)
            if side != 0
        )
        largest = float(np.max(np.abs(self.missing)))
        missing = ", ".join(
            f"{name} {value:.3g} {'N m' if 'moment' in name else 'N'}"
            for name, value in zip(rows, self.missing, strict=True)
            if abs(value) >= NAMED * largest
        )
        return [
            ("bounds missed by", f"{self.beyond:.3g} N ({limiting})"),
            ("wrench missed by", f"{self.size:.3g} N ({missing})"),
        ]

    def words(self, cables: Sequence[str], rows: Sequence[str]) -> str:
        """The same in one line."""
        return "; ".join(f"{label} {words}" for label, words in self.rows(cables, rows))


def shortfall(problem: TensionProblem) -> Shortfall:
    """How far an infeasible problem is from a feasible one, by a linear program and least slack.

    Args:
        problem: The problem; of a feasible one `beyond` and `size` are zero to rounding.

    Source: for the least slack, `optimal_kernel.least_slack`.
    """
    from scipy.optimize import linprog  # half a second, which feasible problems do not need

    W, n, m = problem.W, *problem.W.shape
    scale = problem.scale_of_rows
    ones = np.ones((m, 1))
    result = linprog(
        np.append(np.zeros(m), 1.0),
        A_ub=np.block([[-np.eye(m), -ones], [np.eye(m), -ones]]),
        b_ub=np.concatenate([-problem.lower, problem.finite_upper()]),
        A_eq=np.column_stack([W / scale[:, np.newaxis], np.zeros(n)]),
        b_eq=-problem.wrench / scale,
        bounds=[(None, None)] * m + [(0.0, None)],
    )
    below, above = -result.ineqlin.marginals.reshape(2, m)
    tensions = np.empty(m)
    arrays = [writable(array) for array in (W, problem.wrench, problem.lower)]
    least_slack(*arrays, problem.finite_upper(), writable(scale), tensions)
    missing = W @ tensions + problem.wrench
    return Shortfall(
        float(result.x[-1]), (above > ACTIVE).astype(int) - (below > ACTIVE),
        tensions, missing, float(np.linalg.norm(missing / scale)),
    )  # fmt: skip
