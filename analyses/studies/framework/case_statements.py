"""Statements of the thesis that several case studies judge."""

from __future__ import annotations

from collections.abc import Sequence

from cdpr_drake.analyses.studies.framework.case_run import converged, outcomes
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import CONSTRUCTION, Check, Finding, statement


def same_accuracy(names: Sequence[str], printed: str) -> Check:
    """The final accuracy does not depend on the perturbation, as long as the run converges.

    Runs can contradict that, by true errors that differ by more than the threshold below which the
    measured one ends a run. They cannot confirm it: below the threshold they were ended.

    Args:
        names: Of the configurations.
        printed: Where the thesis shows it.
    """

    @statement(
        "The final accuracy is the same whatever the perturbation, as long as it is stable.",
        printed,
        basis=CONSTRUCTION,
        rule="contradicted where means of runs that converged differ by more than the threshold "
        "below which a run ends",
    )
    def accuracy(runs: Runs) -> Finding:
        stable = [name for name in names if converged(runs, name)]
        errors = {name: 1e3 * runs.mean("position_error_m", configuration=name) for name in names}
        close = [errors[name] for name in stable]
        threshold = 1e3 * runs.largest("stop_position_m", configuration=tuple(names))
        differs = len(close) > 1 and max(close) - min(close) > threshold
        words = ", ".join(
            f"{name} {error:.2f}" + ("" if name in stable else f" ({outcomes(runs, name)})")
            for name, error in errors.items()
        )
        return Finding(
            found=f"{words} mm; a run ends below {threshold:g} mm",
            held=[False] if differs else [],
            why="A run ends when the measured error stays below the threshold, whatever came "
            "before, so the errors of runs that converged agree by construction; the thesis' runs "
            "ended likewise.",
        )

    return accuracy
