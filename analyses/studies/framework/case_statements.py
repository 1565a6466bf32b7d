"""Statements of the thesis that several case studies judge."""

from __future__ import annotations

from collections.abc import Sequence

from cdpr_drake.analyses.reporting.statements import NOT_CONFIRMED, NOT_TESTABLE, Statement
from cdpr_drake.analyses.studies.framework.case_run import CaseRuns


def same_accuracy(runs: CaseRuns, names: Sequence[str], printed: str) -> Statement:
    """The final accuracy does not depend on the perturbation, as long as the run converges.

    These runs can contradict that, by true errors that differ by more than the threshold below
    which the measured one ends a run. They cannot confirm it: below the threshold they were ended.
    """
    stable = [name for name in names if runs.converged(name)]
    errors = {name: 1e3 * runs.mean(name, "position_error_m") for name in names}
    close = [errors[name] for name in stable]
    threshold = 1e3 * max(run.stop_position for name in names for run in runs.of(name))
    differs = len(close) > 1 and max(close) - min(close) > threshold
    words = ", ".join(
        f"{name} {error:.2f}" + ("" if name in stable else f" ({runs.outcomes(name)})")
        for name, error in errors.items()
    )
    return Statement(
        "The final accuracy is the same whatever the perturbation, as long as it is stable.",
        printed,
        f"{words} mm; a run ends below {threshold:g} mm",
        NOT_CONFIRMED if differs else NOT_TESTABLE,
        "A run ends when the measured error stays below the threshold, whatever came before, so "
        "the errors of runs that converged agree by construction; the thesis' runs ended likewise.",
    )
