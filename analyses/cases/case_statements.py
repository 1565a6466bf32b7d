"""Statements of the thesis that several case studies judge."""

from __future__ import annotations

from collections.abc import Sequence

from cdpr_drake.analyses.cases.case_run import CaseRuns
from cdpr_drake.analyses.statements import Statement, verdict

SAME_ACCURACY = 3.0
"""Final errors within this factor of each other count as the same: they lie anywhere below the
threshold that ends a run."""


def same_accuracy(runs: CaseRuns, names: Sequence[str], printed: str) -> Statement:
    """The final accuracy does not depend on the perturbation, as long as the run converges."""
    stable = [name for name in names if runs.converged(name)]
    errors = {name: 1e3 * runs.mean(name, "position_error_m") for name in names}
    close = [errors[name] for name in stable]
    same = len(close) > 1 and max(close) < SAME_ACCURACY * min(close)
    words = ", ".join(
        f"{name} {error:.2f}" + ("" if name in stable else f" ({runs.outcomes(name)})")
        for name, error in errors.items()
    )
    return Statement(
        "The final accuracy is the same whatever the perturbation, as long as it is stable.",
        printed,
        f"{words} mm",
        verdict(same),
        "A run ends when the measured error stays below the threshold, whatever came before.",
    )
