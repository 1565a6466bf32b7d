"""What the study says of fusion, judged from its runs."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cdpr_drake.analyses.reporting import Statement, judged_statements, verdict
from cdpr_drake.analyses.studies.fusion.slack_trials import KINDS, SLACK_COLUMNS, SURPLUSES_CM
from cdpr_drake.analyses.studies.fusion.trials import COLUMNS
from cdpr_drake.arrays import Array

Found = Mapping[str, Mapping[str, Array]]

THREE = ("on_board", "external", "both")

EQUAL = 1.1
"""Up to this share more error counts as no more."""

WORST = 1.5
"""The same for the worst of all seeds."""

ARRIVED = 1e-3
"""Distance of the target from where it should be at which a servo has arrived [m]."""

CONSISTENT = 4.0
"""How many standard deviations of a mean of chi-square numbers it may be from their mean."""


def column(found: Found, name: str, key: str) -> Array:
    """A column of a configuration, shape (runs,)."""
    return np.asarray(found[name]["numbers"][:, COLUMNS.index(key)])


def _mm(values: Array) -> str:
    return f"{1e3 * np.mean(values):.1f} mm"


def _both_as_good_as_the_better(found: Found) -> Statement:
    """Errors with two cameras against those with either."""
    alone = np.minimum(column(found, "on_board", "mean_m"), column(found, "external", "mean_m"))
    ratios = column(found, "both", "mean_m") / alone
    on_board, external, both = (_mm(column(found, name, "mean_m")) for name in THREE)
    return Statement(
        "An onboard and an external camera could be combined: the pose is then known no worse than "
        "by the better one alone.",
        "perspectives",
        "mean error of the pose over that of the better one of each seed: "
        f"{np.median(ratios):.2f} (median), {np.max(ratios):.2f} at most; on board {on_board}, in "
        f"the world {external}, both {both}",
        verdict(
            bool(np.median(ratios) <= EQUAL and np.max(ratios) <= WORST),
            bool(np.median(ratios) <= EQUAL),
        ),
    )


def _survives_either_failure(found: Found) -> Statement:
    """Runs in which a camera fails for 3 s."""
    names = ("both, on_board covered", "both, external covered", "both, on_board frozen",
             "both, external off")  # fmt: skip
    ends = {name: column(found, name, "servo_m") for name in names}
    still = {name: column(found, name, "lost_s") for name in names}
    arrived = all(np.all(values <= ARRIVED) for values in ends.values())
    moving = all(np.all(values <= 0.1) for values in still.values())
    worst = ", ".join(f"{name[6:]} {1e3 * np.max(v):.2f} mm" for name, v in ends.items())
    return Statement(
        "Either camera may fail for 3 s under way: the servo goes on and arrives.",
        "perspectives",
        f"largest distance at the end: {worst}; longest stop "
        f"{max(float(np.max(v)) for v in still.values()):.2f} s",
        verdict(arrived and moving, arrived or moving),
    )


def _wrong_calibration_is_found(found: Found) -> Statement:
    """An external camera that is wrong in calibration."""
    gated, open_ = (
        column(found, name, "mean_m")
        for name in ("both, external wrong", "both, external wrong, no gates")
    )
    alone, good = column(found, "external wrong", "mean_m"), column(found, "both", "mean_m")
    return Statement(
        "The measurement accuracy of an external camera needs to be high for it to be beneficial; "
        "one that is 2 cm and 1 deg wrong is found out beside one on board.",
        "perspectives, chapter 2",
        f"mean error of the pose: alone {_mm(alone)}, both {_mm(gated)}, both with nothing left "
        f"out {_mm(open_)}; both with a right one {_mm(good)}",
        verdict(
            bool(np.mean(gated) < 0.5 * np.mean(open_) and np.mean(gated) < np.mean(alone)),
            bool(np.mean(gated) < np.mean(open_)),
        ),
    )


def _consistent(found: Found) -> Statement:
    """The filter's errors against its covariance."""
    words, good = [], []
    for name in THREE:
        ends = column(found, name, "nees")
        spread = CONSISTENT * np.sqrt(12.0 / len(ends))
        good.append(abs(np.mean(ends) - 6.0) <= spread)
        words.append(f"{name} {np.mean(ends):.1f}")
    return Statement(
        "The filter is as uncertain as it is wrong: its normalized error squared is 6 in the mean.",
        "ours",
        f"at the end, {', '.join(words)}; within {spread:.1f} for so many runs",
        verdict(all(good), any(good)),
    )


def _imu_improves_rotation(found: Found) -> Statement:
    """Rotation with and without an inertial sensor."""
    without, with_imu = (column(found, name, "mean_rad") for name in ("external", "external, imu"))
    both, both_imu = (column(found, name, "mean_rad") for name in ("both", "both, imu"))
    shares = [float(np.mean(b) / np.mean(a)) for a, b in ((without, with_imu), (both, both_imu))]
    return Statement(
        "Sensor fusion can be useful: an IMU can provide the moving-platform orientation.",
        "perspectives",
        f"mean error of rotation with it over that without: in the world {shares[0]:.2f} "
        f"({np.degrees(np.mean(with_imu)):.2f} deg), both {shares[1]:.2f} "
        f"({np.degrees(np.mean(both_imu)):.2f} deg)",
        verdict(max(shares) < 0.95, min(shares) < 0.95),
    )


def _depth_improves_position(found: Found) -> Statement:
    """Position along the axis with and without depths."""
    shares = [
        float(np.mean(column(found, b, "mean_m")) / np.mean(column(found, a, "mean_m")))
        for a, b in (("external", "external, depth"), ("both", "both, depth"))
    ]
    return Statement(
        "Sensor fusion can be useful: depth sensors can measure the distance along its axis.",
        "perspectives",
        f"mean error of position with depths of a Kinect over that without: in the world "
        f"{shares[0]:.2f}, both {shares[1]:.2f}",
        verdict(max(shares) < 0.95, min(shares) < 0.95),
    )


def _slack(found: Found, kind: str, cm: int, key: str) -> Array:
    return np.asarray(found[f"{kind}, {cm} cm"]["numbers"][:, SLACK_COLUMNS.index(key)])


def _rate_by_seen_slack(found: Found) -> Statement:
    """Time to wind in slack at a rate from images."""
    times = {
        kind: [float(np.mean(_slack(found, kind, cm, "taut_s"))) for cm in SURPLUSES_CM]
        for kind in KINDS
    }
    others = [times[kind][-1] for kind in KINDS if kind != "image"]
    wrong = np.concatenate([_slack(found, "image", cm, "seen_error_m") for cm in SURPLUSES_CM])
    words = "; ".join(f"{k} {', '.join(f'{t:.2f}' for t in v)} s" for k, v in times.items())
    large, first = times["image"][-1], times["image"][-1] < min(others)
    return Statement(
        "By detecting the amount of slack on a cable the TCA correction rate can be adjusted to "
        "decrease a large slack more rapidly.",
        "perspectives",
        f"2, 4 and 8 cm gone after: {words}; seen slack is wrong by {1e3 * np.nanmean(wrong):.1f} "
        "mm in the mean",
        verdict(first and large < 0.6 * times["constant"][-1], first),
    )


JUDGES = (
    _both_as_good_as_the_better,
    _survives_either_failure,
    _wrong_calibration_is_found,
    _consistent,
    _imu_improves_rotation,
    _depth_improves_position,
    _rate_by_seen_slack,
)
"""All judges of the study."""


def fusion_statements(found: Found, quick: bool = False) -> list[Statement]:
    """All statements for which there are runs; of the `quick` form also the names of the others."""
    return judged_statements(JUDGES, found, quick)
