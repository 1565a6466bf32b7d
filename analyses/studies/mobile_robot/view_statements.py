"""Whether the view of the tag decides how long the mobile robot is followed."""

from __future__ import annotations

from collections.abc import Mapping

from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import OURS, Finding, statement
from cdpr_drake.analyses.studies.mobile_robot.configurations import (
    CHOSEN_VIEW,
    NUMBERS,
    PUBLISHED_LAPS,
    VIEWED_ESTIMATORS,
    VIEWS,
    view_margin,
)
from cdpr_drake.analyses.studies.mobile_robot.statements import (
    FACTOR,
    laps_words,
    median_laps,
    near,
)

FIRST = "control_integration"
"""The estimator that the thesis follows longest."""


def view_prefixes() -> Mapping[str, tuple[str, float]]:
    """Of each view, least margin first: how names of its configurations begin, and its margin
    [m]."""
    views = {"as chosen": ("", view_margin(*CHOSEN_VIEW))}
    views |= {name: (f"{name}, ", view_margin(*view)) for name, view in VIEWS.items()}
    return dict(sorted(views.items(), key=lambda item: item[1][1]))


@statement(
    "How long the mobile robot is followed is decided by how far the tag may drift in the image, "
    "its size and distance.",
    "neither; Est. 1 12 laps, Est. 4 2, Est. 7 4",
    rule=f"Two parts: in one view all three medians are within a factor {FACTOR:g} of the printed "
    "laps; Est. 1, which fails in all views, lasts the longer the more margin there is.",
    basis=OURS,
)
def view_decides(runs: Runs) -> Finding:
    """How long estimators 1, 4 and 7 last in other views."""
    words, agree, first, reversed_order = [], [], [], []
    for name, (prefix, margin) in view_prefixes().items():
        laps = {k: median_laps(runs, f"{prefix}estimator {k}") for k in VIEWED_ESTIMATORS}
        ends = "; ".join(
            f"{NUMBERS[k]}: {laps_words(runs(configuration=f'{prefix}estimator {k}'))}"
            for k in laps
        )
        words.append(f"{name}, margin {1e3 * margin:.0f} mm: {ends}")
        agree.append(all(near(laps[k], PUBLISHED_LAPS[k]) for k in laps))
        first.append(laps[FIRST])
        reversed_order.append(laps[FIRST] < min(laps[k] for k in laps if k != FIRST))
    return Finding(
        found=". ".join(words),
        held=[any(agree), first == sorted(first) and first[0] < first[-1]],
        why=f"Est. 1 ends before both by lengths in {sum(reversed_order)} of {len(reversed_order)} "
        "views, in the medians.",
    )


CHECKS = (view_decides,)
"""Judges of the view."""
