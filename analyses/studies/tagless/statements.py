"""What servoing without tags has to show, and whether it does."""

from __future__ import annotations

import numpy as np

from cdpr_drake.analyses.reporting.statements import Statement, verdict
from cdpr_drake.analyses.studies.framework.seeded_study import StudyData
from cdpr_drake.analyses.studies.tagless.trials import COLUMNS, SCHEMES, TAG, is_lost
from cdpr_drake.arrays import Array
from cdpr_drake.vision.texture_pictures import TEXTURES

WITHIN = 3.0
"""Times the final error with a tag that a textured square may have."""


def runs_of(found: StudyData, scheme: str, target: str) -> Array:
    """`COLUMNS` of the runs of a scheme on a target, shape (n, 6); KeyError where there are none
    yet."""
    return np.asarray(found[task_name(scheme, target)]["runs"])


def task_name(scheme: str, target: str) -> str:
    """Name of the task that runs them."""
    return f"{scheme} {target}"


def medians(runs: Array) -> Array:
    """Median final distance [m] and angle [deg] of the runs that were not lost, shape (2,)."""
    arrived = runs[~is_lost(runs)]
    return np.median(arrived[:, :2], axis=0) if len(arrived) else np.full(2, np.inf)


def _accuracy(found: StudyData, scheme: str) -> Statement:
    tag = medians(runs_of(found, scheme, TAG))
    ratios = {name: medians(runs_of(found, scheme, name)) / tag for name in TEXTURES}
    count = len(runs_of(found, scheme, TAG))
    words = "; ".join(f"{name} {r[0]:.2f} and {r[1]:.2f}" for name, r in ratios.items())
    good = [bool(np.all(ratio <= WITHIN)) for ratio in ratios.values()]
    return Statement(
        f"Without tags, {scheme}: final errors as with a tag of the same size.",
        f"median distance and angle at most {WITHIN:g} times",
        f"{words} times those of the tag, {1e3 * tag[0]:.3g} mm and {tag[1]:.3g} deg; "
        f"{count} starts",
        verdict(all(good), any(good)),
    )


def _pbvs(found: StudyData) -> Statement:
    """Final errors without tags, PBVS."""
    return _accuracy(found, "pbvs")


def _ibvs(found: StudyData) -> Statement:
    """Final errors without tags, IBVS."""
    return _accuracy(found, "ibvs")


def _hybrid(found: StudyData) -> Statement:
    """Final errors without tags, 2 1/2 D."""
    return _accuracy(found, "2.5d")


def _losses(found: StudyData) -> Statement:
    """Runs without tags that lose their target or do not arrive."""
    lost: dict[str, list[int]] = {}
    blind: dict[str, int] = {}
    for name in (TAG, *TEXTURES):
        each = [runs_of(found, scheme, name) for scheme in SCHEMES]
        lost[name] = [int(np.sum(is_lost(runs))) for runs in each]
        blind[name] = int(sum(np.sum(runs[:, COLUMNS.index("without_target")]) for runs in each))
    words = "; ".join(
        f"{name} {' + '.join(map(str, lost[name]))} runs, {blind[name]} images" for name in lost
    )
    totals = {name: sum(counts) for name, counts in lost.items()}
    good = [totals[name] <= totals[TAG] for name in TEXTURES]
    return Statement(
        "Without tags no more runs lose their target or do not arrive.",
        "as many as with the tag at most",
        f"{words} ({' + '.join(SCHEMES)})",
        verdict(all(good), any(good)),
    )


CHECKS = (_pbvs, _ibvs, _hybrid, _losses)
"""All of them."""
