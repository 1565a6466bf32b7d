"""What the study runs: estimators, correction or none, what is not printed at three values, and the
tag at other distances and sizes."""

from __future__ import annotations

import math
from collections.abc import Iterator

from cdpr_drake.analyses.studies.framework.study import Case, Form

ALL_LAPS, QUICK_LAPS = 700, 2
"""Laps with tension correction."""

ESTIMATOR_LAPS, PLAIN_LAPS, VARIED_LAPS = 30, 60, 60
"""After so many laps runs end that have not failed."""

PLAIN = "tension_management=null"
NO_KNOWN_TAG = "estimator.known_tag=null"

PUBLISHED_LAPS = {
    "control_integration": 12,
    "cable_lengths": 2,
    "cable_lengths_elastic": 3,
    "cable_lengths_pulleys": 3,
    "cable_lengths_elastic_pulleys": 4,
}
"""Laps after which the thesis' estimators 1, 4, 5, 6 and 7 failed without a known tag, 2.3.7."""

NUMBERS = {
    "control_integration": 1, "cable_lengths": 4, "cable_lengths_elastic": 5,
    "cable_lengths_pulleys": 6, "cable_lengths_elastic_pulleys": 7,
}  # fmt: skip
"""Numbers of these estimators in the thesis."""

PUBLISHED_PLAIN = 29
"""Lap in which tracking failed without tension correction, 5.3.1."""

VARIED_ESTIMATORS = ("cable_lengths", "cable_lengths_elastic_pulleys")
"""Estimators, the simplest and the best by lengths, of which what is not printed is varied."""

_TRACK = "target.motion.mobile_robot"

VARIED: dict[str, tuple[str, tuple[str, ...], float]] = {
    "track smaller": (
        "track 0.20 x 0.12 m",
        (f"{_TRACK}.length=0.2", f"{_TRACK}.width=0.12", f"{_TRACK}.corner_radius=0.04"),
        1.0,
    ),
    "track larger": (
        "track 0.29 x 0.18 m",
        (f"{_TRACK}.length=0.29", f"{_TRACK}.width=0.18", f"{_TRACK}.corner_radius=0.06"),
        1.0,
    ),
    "friction none": ("no friction", (), 0.0),
    "friction more": ("friction x 3", (), 3.0),
    "offset less": ("winches run off by 0.5 mm/s", ("perturbations.winch_offset=0.0005",), 1.0),
    "offset more": ("winches run off by 2 mm/s", ("perturbations.winch_offset=0.002",), 1.0),
    "spread less": ("+- 0.1 mm/s", ("perturbations.winch_offset_spread=0.0001",), 1.0),
    "spread more": ("+- 0.4 mm/s", ("perturbations.winch_offset_spread=0.0004",), 1.0),
}
"""What is not printed, less and more than chosen: words, changes, friction."""

CHOSEN_VIEW = (0.30, 0.06)
"""Distance and edge of the tag in the scenario [m]."""

VIEWS: dict[str, tuple[float, float]] = {
    "view 0.20 m, 60 mm": (0.20, 0.06),
    "view 0.20 m, 90 mm": (0.20, 0.09),
    "view 0.16 m, 30 mm": (0.16, 0.03),
    "view 0.16 m, 60 mm": (0.16, 0.06),
}
"""Distance and edge of the tag [m], neither of which is printed: 0.16 m is that of case study I,
0.20 m the nearest at which the lens focuses, table A.4."""

VIEWED_ESTIMATORS = ("control_integration", *VARIED_ESTIMATORS)
"""Estimators that follow the tag in other views."""

VIEW_ANGLE = 59.4
"""Angle of view along the image's short side [deg]. Source: table A.4."""

BELOW = 0.04
"""Height of the platform's origin above the tag, less the camera's distance [m]: with that of the
scenario, 0.34 m above the ground and 0.30 m above the tag, the run begins near the tag's middle."""

PLAIN_RUN, CORRECTED = "plain", "corrected"
"""Names of the configurations with a known tag, as chosen."""

PUBLISHED = {
    **{f"estimator {kind}": f"fails after {laps} laps" for kind, laps in PUBLISHED_LAPS.items()},
    PLAIN_RUN: f"fails in lap {PUBLISHED_PLAIN}",
    CORRECTED: "700 laps, never more than two cables slack",
}
"""What the thesis prints, by configuration, in words."""


def cases(form: Form) -> Iterator[Case]:
    """All configurations, or the few of the quick form for two laps."""
    for kind in ("cable_lengths",) if form.quick else PUBLISHED_LAPS:
        words = f"no known tag, estimator {NUMBERS[kind]}, {kind.replace('_', ' ')}"
        laps = QUICK_LAPS if form.quick else ESTIMATOR_LAPS
        yield _case(f"estimator {kind}", words, laps, _estimator(kind))
    laps, all_laps = (QUICK_LAPS,) * 2 if form.quick else (PLAIN_LAPS, ALL_LAPS)
    yield _case(PLAIN_RUN, "no correction", laps, (PLAIN,))
    yield _case(CORRECTED, "with correction", all_laps, ())
    if form.quick:
        return
    for name, (words, changes, friction) in VARIED.items():
        for other, correction in ((PLAIN_RUN, (PLAIN,)), (CORRECTED, ())):
            some = (*changes, *correction)
            yield _case(f"{name}, {other}", f"{words}, {other}", VARIED_LAPS, some, friction)
        for kind in VARIED_ESTIMATORS:
            some = (*changes, *_estimator(kind))
            label = f"{words}, estimator {NUMBERS[kind]}"
            yield _case(f"{name}, estimator {kind}", label, ESTIMATOR_LAPS, some, friction)
    for name, (distance, edge) in VIEWS.items():
        for kind in VIEWED_ESTIMATORS:
            some = (*view_changes(distance, edge), *_estimator(kind))
            label = f"{name}, estimator {NUMBERS[kind]}"
            yield _case(f"{name}, estimator {kind}", label, ESTIMATOR_LAPS, some)


def view_margin(distance: float, edge: float) -> float:
    """How far a tag in the middle of the image may go along its short side until a corner leaves it
    [m].

    Args:
        distance: Of the tag from the camera [m].
        edge: Of the tag, parallel to the image [m].
    """
    return distance * math.tan(math.radians(VIEW_ANGLE / 2.0)) - edge / 2.0


def view_changes(distance: float, edge: float) -> tuple[str, ...]:
    """Items for a tag of an edge that is followed at a distance [m]; the tag keeps its height, the
    platform begins and stays higher or lower."""
    return (
        f"target.size={edge:g}",
        f"desired={{position: [0, 0, {distance:g}], angles_deg: [180, 0, 180]}}",
        f"initial_pose={{position: [0.0, -0.08, {distance + BELOW:g}]}}",
    )


def _estimator(kind: str) -> tuple[str, ...]:
    """What makes a run of an estimator without a known tag."""
    return PLAIN, NO_KNOWN_TAG, f"estimator.kind={kind}"


def _case(
    name: str, words: str, laps: int, changes: tuple[str, ...], friction: float = 1.0
) -> Case:
    return Case(
        name=name,
        keys={"configuration": name, "words": words, "asked_laps": laps, "friction": friction},
        changes=changes,
        printed={"laps_done": PUBLISHED[name]} if name in PUBLISHED else {},
    )
