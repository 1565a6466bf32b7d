"""What has to hold of calibrated robots."""

from __future__ import annotations

import numpy as np
from scipy.stats import chi2

from cdpr_drake.analyses.studies.calibration.servo import MODELS
from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Runs
from cdpr_drake.analyses.studies.framework.statement import OURS, Finding, statement
from cdpr_drake.arrays import Array

CAMERA, HALF_SIZE, SERVO, TRACKER, START = "camera", "half", "servo", "tracker", "start"
"""Kinds of trials."""

EXITS_WITHIN, ANCHORS_WITHIN = 1e-3, 0.5e-3
BOUND_WITHIN, STRAIGHT_WITHIN = 0.2, 0.2
START_WITHIN, TURN_WITHIN = 0.01, 2.0
SURE = 0.01
"""Share of studies with right covariances in which chi-square of all seeds is called wrong."""

FALLS = 0.5
"""To which share the excess has to fall; it is a quarter to second order."""

CONSISTENT = 0.1
"""By which chi-square per degree of freedom may differ from 1 and be right in part: 5 per cent of
a standard deviation."""


@statement(
    "the camera on board alone gives points back, frames that it cannot see left out",
    "exit points within 1 mm, anchor points within 0.5 mm, rms",
    rule="rms over all seeds; both have to be within",
    basis=OURS,
)
def points(runs: Runs) -> Finding:
    """Errors of exit and anchor points."""
    some = runs(kind=CAMERA)
    exits, anchors = some["exit_points_m"], some["anchor_points_m"]
    each = np.mean((exits < EXITS_WITHIN) & (anchors < ANCHORS_WITHIN))
    return Finding(
        found=f"{1e3 * rms(exits):.2f} and {1e3 * rms(anchors):.2f} mm over all seeds; both in "
        f"{100 * each:.0f} % of them",
        held=[rms(exits) < EXITS_WITHIN, rms(anchors) < ANCHORS_WITHIN],
        some=False,
    )


@statement(
    "errors and residuals are as large as covariances say",
    "chi-square per degree of freedom of errors, of residuals: 1",
    rule=f"within what {1 - SURE:.0%} of all studies with right covariances find; in part where "
    f"both are within {CONSISTENT:g} of 1",
    basis=OURS,
)
def covariance(runs: Runs) -> Finding:
    """Errors and residuals beside covariances."""
    some, found = runs(kind=CAMERA), []
    for name in ("errors", "residuals"):
        total, count = np.sum(some[f"{name}_chi_square"]), np.sum(some[f"{name}_degrees"])
        low, high = chi2.ppf([SURE / 2, 1 - SURE / 2], count)
        found.append((total / count, low / count, high / count))
    words = ", ".join(f"{a:.3f} (accepted {b:.3f} to {c:.3f})" for a, b, c in found)
    straight = np.sum(some["errors_chi_square_straight"]) / np.sum(some["errors_degrees"])
    return Finding(
        found=f"{words}; {straight:.3f} of errors along straight coordinates",
        held=[b < a < c for a, b, c in found],
        some=all(abs(a - 1.0) < CONSISTENT for a, _, _ in found),
        why="errors are taken with frames moved along arcs: the camera hardly tells how the world "
        "is tilted, and a tilt of some mrad moves points off its tangent by more than their "
        "own deviations; a covariance knows tangents alone",
    )


@statement(
    "what errors along straight coordinates have too much is the curvature of frames",
    f"it falls, at least to {FALLS:g}, when noise and what is off are half as large",
    basis=OURS,
)
def curvature(runs: Runs) -> Finding:
    """What errors along straight coordinates have too much is of second order."""
    some = runs(kind=HALF_SIZE)
    if len(some) < 2:
        raise MissingRuns("more than one seed: of one alone the excess may have either sign")
    excess = [
        float(np.mean(some[f"{size}_chi_square_straight"] - some[f"{size}_chi_square"]))
        for size in ("whole", "half")
    ]
    return Finding(
        found=f"{excess[0]:.2f} to {excess[1]:.2f} of chi-square, mean over {len(some)} seeds "
        "with the same random numbers",
        held=[excess[0] > 0.0 and abs(excess[1]) < FALLS * excess[0]],
    )


@statement(
    "with a tracker, errors are at the Cramer-Rao bound",
    "rms of errors over their bounds: 0.8 to 1.2",
    basis=OURS,
)
def bound(runs: Runs) -> Finding:
    """Errors beside their bound."""
    ratios = runs(kind=TRACKER)["errors_over_bound"]
    each = np.sqrt(np.mean(np.square(ratios), axis=0))
    return Finding(
        found=f"{rms(ratios):.3f}; single coordinates {each.min():.2f} to {each.max():.2f}",
        held=[abs(rms(ratios) - 1.0) < BOUND_WITHIN],
    )


@statement(
    "winches and tension sensors alone find an unknown start",
    "within 10 mm and 2 deg from 300 mm and 20 deg off",
    rule="each seed",
    basis=OURS,
)
def start(runs: Runs) -> Finding:
    """The start that winches and tensions find."""
    some = runs(kind=START)
    distance, angle = some["distance_m"], some["angle_deg"]
    within = (distance < START_WITHIN) & (angle < TURN_WITHIN)
    return Finding(
        found=f"{1e3 * distance.max():.1f} mm and {angle.max():.2f} deg at most; within in "
        f"{np.sum(within)} of {len(within)}",
        held=within.tolist(),
        why="what is not within is told to be that uncertain, see below: lengths with noise of "
        "0.1 % do not tell more",
    )


@statement(
    "errors of the start are no larger than the calibration says of itself",
    rule=f"by chance {SURE:.0%} of all studies have one that is larger",
    basis=OURS,
)
def told(runs: Runs) -> Finding:
    """A start that is found badly is said to be."""
    some = runs(kind=START)
    shares = np.array([
        some["distance_m"] / some["distance_std_m"], some["angle_deg"] / some["angle_std_deg"]
    ])  # fmt: skip
    # Of all ways to share a variance among three coordinates, one alone spreads the most.
    sure = chi2.isf(SURE / len(some), 1) ** 0.5
    return Finding(
        found=f"{shares[0].max():.2f} and {shares[1].max():.2f} at most, "
        f"{rms(shares[0]):.2f} and {rms(shares[1]):.2f} rms; deviations up to "
        f"{1e3 * some.largest('distance_std_m'):.1f} mm and "
        f"{some.largest('angle_std_deg'):.2f} deg",
        held=np.all(shares < sure, axis=0).tolist(),
        some=False,
        printed=f"each at most {sure:.2f} of its standard deviations",
    )


@statement(
    "with the calibrated robot the camera moves as straight as with the true one",
    "largest distance from the line within 20 %",
    rule="each seed",
    basis=OURS,
)
def servo(runs: Runs) -> Finding:
    """What a visual servo gains."""
    rows = runs(kind=SERVO).list("straightness_m")
    by_model = {name: np.array([row[name] for row in rows]) for name in MODELS}
    excess = np.abs(by_model["calibrated"] / by_model["true"] - 1.0)
    words = ", ".join(f"{name} {1e3 * np.mean(v):.2f} mm" for name, v in by_model.items())
    return Finding(
        found=f"{words}; {100 * excess.max():.0f} % apart at most",
        held=(excess < STRAIGHT_WITHIN).tolist(),
    )


def rms(values: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


CHECKS = (points, covariance, curvature, bound, start, told, servo)
