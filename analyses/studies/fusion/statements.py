"""What the study says of fusion, judged from its runs."""

from __future__ import annotations

import numpy as np

from cdpr_drake.analyses.reporting.statements import Statement, verdict
from cdpr_drake.analyses.studies.framework.seeded_study import StudyData
from cdpr_drake.analyses.studies.fusion.slack_trials import KINDS, SLACK_COLUMNS, SURPLUSES_CM
from cdpr_drake.analyses.studies.fusion.trials import COLUMNS
from cdpr_drake.arrays import Array

THREE = ("on_board", "external", "both")

EQUAL = 1.1
"""Up to this share more error counts as no more."""

TOLD_WRONG = ("both, on_board wrong, told", "both, external wrong, told")
"""Cameras that are wrong from the start, of which the filter is told that they may be."""

ARRIVED = 1e-3
"""Distance of the target from where it should be at which a servo has arrived [m]."""

CONSISTENT = 4.0
"""How many standard deviations of a mean of chi-square numbers it may be from their mean."""


def column(found: StudyData, name: str, key: str) -> Array:
    """A column of a configuration, shape (runs,)."""
    return np.asarray(found[name]["numbers"][:, COLUMNS.index(key)])


def _mm(values: Array) -> str:
    return f"{1e3 * np.mean(values):.1f} mm"


def _both_as_good_as_the_better(found: StudyData) -> Statement:
    """Errors with two cameras against those with the one that is better over all seeds.

    Which one is the better in a single seed nobody knows beforehand. What the filters expect is
    told, but does not count: a filter with more readings always expects less.
    """
    errors = {name: column(found, name, "mean_m") for name in THREE}
    if len(errors["both"]) < 2:
        raise KeyError("one seed has no spread")
    better = min(THREE[:2], key=lambda name: float(np.mean(errors[name])))
    more = errors["both"] - errors[better]
    mean, chance = float(np.mean(more)), 2.0 * float(np.std(more, ddof=1)) / np.sqrt(len(more))
    means = ", ".join(
        f"{words} {_mm(errors[name])} (expected {_mm(column(found, name, 'expected_m'))})"
        for name, words in zip(THREE, ("on board", "in the world", "both"), strict=True)
    )
    lucky = errors["both"] / np.minimum(errors["on_board"], errors["external"])
    return Statement(
        "An onboard and an external camera could be combined: the pose is then known no worse than "
        "by the better one alone.",
        "perspectives",
        f"mean error of the pose over {len(more)} seeds: {means}; both less the better one "
        f"{1e3 * mean:+.1f} mm, by chance up to {1e3 * chance:.1f}; over the luckier one of each "
        f"seed {np.median(lucky):.2f} (median), {np.max(lucky):.2f} at most",
        verdict(mean <= 0.0, mean <= chance),
        "In part: no more than by chance, two standard deviations of the mean difference.",
    )


def _is_consistent(ends: Array) -> bool:
    """Whether normalized errors of six numbers are 6 in the mean, as far as so many tell."""
    return bool(abs(np.mean(ends) - 6.0) <= CONSISTENT * np.sqrt(12.0 / len(ends)))


def _survives_either_failure(found: StudyData) -> Statement:
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


def _wrong_calibration_is_found(found: StudyData) -> Statement:
    """An external camera that is wrong in calibration."""
    names = ("both, external wrong", "both, external wrong, told", "both, external wrong, doubted")
    trusted, told, doubted = (column(found, name, "mean_m") for name in names)
    alone, good = column(found, "external wrong", "mean_m"), column(found, "on_board", "mean_m")
    sure = np.mean(column(found, names[1], "wrong_external"))
    return Statement(
        "The measurement accuracy of an external camera needs to be high for it to be beneficial; "
        "one that is 2 cm and 1 deg wrong is found out beside one on board.",
        "perspectives, chapter 2",
        f"mean error of the pose: in the world alone {_mm(alone)}, both {_mm(trusted)}; told that "
        f"it may be so far off {_mm(told)}, found wrong with {sure:.0%}; either camera doubted a "
        f"little {_mm(doubted)}; on board alone, right, {_mm(good)}",
        verdict(
            bool(np.mean(told) <= EQUAL * np.mean(good) and sure > 0.5),
            bool(np.mean(told) < np.mean(trusted)),
        ),
    )


def _wrong_calibration_costs_nothing(found: StudyData) -> Statement:
    """What a wrong external camera does to a servo that sees its target."""
    names = (*TOLD_WRONG, "both, external wrong", "both, external wrong, doubted",
             "both, external knocked", "both, external knocked, doubted")  # fmt: skip
    ends = {name: column(found, name, "servo_m") for name in names}
    covered = column(found, "both, external wrong, told, on_board covered", "servo_m")
    worst = max(float(np.max(values)) for values in ends.values())
    return Statement(
        "A camera in the world that is wrong does not move the target in the camera on board: a "
        "servo that sees the target arrives.",
        "ours",
        f"largest distance at the end, wrong from the start or from 3 s on: {1e3 * worst:.2f} mm; "
        f"with the camera on board covered from 2 s to the end {1e3 * np.mean(covered):.1f} mm "
        f"({1e3 * np.max(covered):.1f})",
        verdict(worst <= ARRIVED, float(np.median(list(ends.values()))) <= ARRIVED),
    )


def _consistent(found: StudyData) -> Statement:
    """The filter's errors against its covariance."""
    words, good = [], []
    for name in (*THREE, "both, doubted", "both, external knocked, doubted", *TOLD_WRONG):
        ends = column(found, name, "nees")
        good.append(_is_consistent(ends))
        words.append(f"{name} {np.mean(ends):.1f}")
    return Statement(
        "The filter is as uncertain as it is wrong: its normalized error squared is 6 in the mean.",
        "ours",
        f"at the end, {'; '.join(words)}; within {CONSISTENT * np.sqrt(12.0 / len(ends)):.1f} for "
        "so many runs",
        verdict(all(good), any(good)),
    )


def _imu_improves_rotation(found: StudyData) -> Statement:
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


def _depth_improves_position(found: StudyData) -> Statement:
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


def _slack(found: StudyData, kind: str, cm: int, key: str) -> Array:
    return np.asarray(found[f"{kind}, {cm} cm"]["numbers"][:, SLACK_COLUMNS.index(key)])


def _rate_by_seen_slack(found: StudyData) -> Statement:
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


CHECKS = (
    _both_as_good_as_the_better,
    _survives_either_failure,
    _wrong_calibration_is_found,
    _wrong_calibration_costs_nothing,
    _consistent,
    _imu_improves_rotation,
    _depth_improves_position,
    _rate_by_seen_slack,
)
"""All judges of the study."""
