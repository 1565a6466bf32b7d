"""What has to hold between loops and verdicts."""

from __future__ import annotations

from collections.abc import Callable

from cdpr_drake.analyses.studies.basin.loops import CERTIFIED, CONVERGED, ENDS, EXPLAINED
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import OURS, SOURCE, Finding, statement
from cdpr_drake.stability.verdict import VERDICTS


def _by_scheme(runs: Runs, words: Callable[[Runs], str]) -> str:
    return "; ".join(f"{scheme}: {words(some)}" for scheme, some in runs.by("scheme"))


def failed(runs: Runs) -> dict[str, int]:
    """Loops from certified starts that did not converge, by how they ended."""
    counts = {end: runs.total(f"{CERTIFIED}_{end}") for end in ENDS if end != CONVERGED}
    return {end: count for end, count in counts.items() if count}


def _failed_words(runs: Runs) -> str:
    found = failed(runs)
    words = ", ".join(f"{count:g} {end}" for end, count in found.items()) or "none"
    return f"{words} of {runs.total(CERTIFIED):g}"


@statement(
    "From a certified start every loop converges.",
    "0 loops do not",
    source="servoing thesis (3.27), 3.4",
    rule="of each scheme every loop whose start is certified under the bounds of its errors",
    basis=OURS,
    cause=SOURCE,
)
def converges_from_certified(runs: Runs) -> Finding:
    """Loops from certified starts that do not converge, by scheme."""
    return Finding(
        found="did not converge: " + _by_scheme(runs, _failed_words),
        held=[not failed(some) for _, some in runs.by("scheme")],
        why="The criterion speaks of one pose with all cables taut and the object seen: ways may "
        "leave the image, the frame and the workspace, and cables may go slack.",
    )


@statement(
    "Where a loop from a certified start does not converge, it is for what the criterion does not "
    f"speak of: {', '.join(EXPLAINED)}.",
    "all",
    rule="none of any scheme ends otherwise",
    basis=OURS,
)
def failures_have_names(runs: Runs) -> Finding:
    """Ends of these loops, of all schemes."""
    by_scheme = {scheme: failed(some) for scheme, some in runs.by("scheme")}
    return Finding(
        found=_by_scheme(runs, _failed_words),
        held=[set(counts) <= set(EXPLAINED) for counts in by_scheme.values()],
    )


@statement(
    "More starts converge than the certificate promises, and than samples find stable.",
    rule="of each scheme: converged above certified, converged above sampled",
    basis=OURS,
)
def basin_is_larger(runs: Runs) -> Finding:
    """Counts of starts by scheme."""
    kinds = (CERTIFIED, "sampled")
    return Finding(
        found=_by_scheme(runs, counted),
        held=[
            some.total(CONVERGED) > some.total(kind)
            for _, some in runs.by("scheme")
            for kind in kinds
        ],
    )


def counted(runs: Runs) -> str:
    """Words on how many starts converge, and how many each verdict finds stable."""
    loops = max(runs.total("runs"), 1)
    names = (CONVERGED, *VERDICTS)
    shares = (f"{name} {100.0 * runs.total(name) / loops:.1f} %" for name in names)
    return f"of {runs.total('runs'):g} loops " + ", ".join(shares)


CHECKS = (converges_from_certified, failures_have_names, basin_is_larger)
