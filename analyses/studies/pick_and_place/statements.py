"""What picking and placing has to show, and whether it does."""

from __future__ import annotations

import numpy as np

from cdpr_drake.analyses.case_studies import Found
from cdpr_drake.analyses.reporting import Statement, verdict
from cdpr_drake.analyses.studies.pick_and_place.trials import (
    CLEAR,
    COLUMNS,
    HIDDEN,
    LOWERED,
    ON_THE_WAY,
    ONE_CAMERA,
    column,
    failed_phase,
    placed,
)
from cdpr_drake.arrays import Array
from cdpr_drake.systems.handling import FAILURE_WORDS, Failure

DISTANCE, ANGLE = 2e-3, float(np.radians(1.0))
"""Within which the box is set down [m, rad]."""


def within(runs: Array) -> np.ndarray:
    """Which runs set the box down within `DISTANCE` and `ANGLE`, shape (n,), bool."""
    near = (column(runs, "distance_m") <= DISTANCE) & (column(runs, "angle_rad") <= ANGLE)
    return np.asarray(placed(runs) & near)


def result_words(runs: Array) -> str:
    """How many runs set the box down as they should, and how far off at most."""
    good, done = within(runs), placed(runs)
    words = f"{int(np.sum(good))} of {len(runs)}"
    if np.any(done):
        distance = 1e3 * float(np.max(column(runs, "distance_m")[done]))
        angle = float(np.degrees(np.max(column(runs, "angle_rad")[done])))
        words += f"; largest {distance:.2f} mm, {angle:.2f} deg"
    failures = sorted({_failure_words(row) for row in runs[~done]})
    return "; ".join([words, *failures])


def _failure_words(row: Array) -> str:
    failure = Failure(int(row[COLUMNS.index("failure")]))
    return f"{failed_phase(row)}: {FAILURE_WORDS.get(failure, 'not ended')}"


def _set_down(runs: Array, words: str, printed: str) -> Statement:
    good = within(runs)
    return Statement(
        words, printed.format(len(runs)), result_words(runs),
        verdict(bool(np.all(good)), bool(np.any(good))),
    )  # fmt: skip


def set_down(found: Found) -> Statement:
    """The box is set down within 2 mm and 1 deg."""
    words = "a box is taken, carried and set down by what two cameras see, within 2 mm and 1 deg"
    return _set_down(found[CLEAR]["runs"], words, "{0} of {0} seeds")


def hidden_on_the_way(found: Found) -> Statement:
    """The same with the goal's tag hidden for 3 s on the way."""
    runs = found[ON_THE_WAY]["runs"]
    words = f"the same with the goal's tag hidden for {HIDDEN:g} s while the box is carried"
    return _set_down(runs, words, "{0} of {0} seeds")


def hidden_while_lowered(found: Found) -> Statement:
    """The same with the goal's tag hidden for 3 s while the box is lowered."""
    runs = found[LOWERED]["runs"]
    words = f"the same with the goal's tag hidden for {HIDDEN:g} s while the box is lowered"
    return _set_down(runs, words, "{0} of {0} seeds")


def one_camera_fails(found: Found) -> Statement:
    """With one camera, which the box blinds, no run comes to an end, and says so."""
    runs = found[ONE_CAMERA]["runs"]
    told = column(runs, "failure") == Failure.TAG_NOT_SEEN
    return Statement(
        "the box occludes the field of view of the camera that saw it, so that with this camera "
        "alone its placing is not accurate: several cameras, or a pan-tilt one, are needed",
        "the goal is not seen",
        f"{int(np.sum(placed(runs)))} of {len(runs)} set the box down; "
        f"{int(np.sum(told))} ended because the goal's tag was not seen",
        verdict(bool(np.all(told)), bool(np.any(told))),
        "the view past the box's sides does not reach the goal's tag",
    )


JUDGES = (set_down, hidden_on_the_way, hidden_while_lowered, one_camera_fails)
