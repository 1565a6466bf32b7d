"""What the study says of fusion, judged from its runs."""

from __future__ import annotations

import numpy as np

from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Runs
from cdpr_drake.analyses.studies.framework.statement import CHOICE, OURS, Finding, statement
from cdpr_drake.analyses.studies.fusion.configurations import DURATION
from cdpr_drake.analyses.studies.fusion.slack_trials import SURPLUSES, WAYS
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


BETTER = 0.95
"""Up to this share of an error it is smaller."""

IMPROVED = "by 5 % at least, beside a camera in the world and beside both"

CHOSEN_SENSORS = (
    "It is an outlook without numbers: cameras, their places, sensors and noise are chosen here, "
    "and how many runs."
)


def column(runs: Runs, name: str, key: str) -> np.ndarray:
    """A column of a configuration, shape (runs,)."""
    return runs(configuration=name, duration_s=DURATION)[key]


def _mm(values: Array) -> str:
    return f"{1e3 * np.mean(values):.1f} mm"


@statement(
    "An onboard and an external camera could be combined: the pose is then known no worse than "
    "by the better one alone.",
    rule="mean error with both at most that with the better one; in part: no more than by chance, "
    "two standard deviations of the mean difference",
    cause=CHOICE,
    why=CHOSEN_SENSORS,
)
def both_as_good_as_the_better(runs: Runs) -> Finding:
    """Errors with two cameras against those with the one that is better over all seeds.

    Which one is the better in a single seed nobody knows beforehand. What the filters expect is
    told, but does not count: a filter with more readings always expects less.
    """
    errors = {name: column(runs, name, "mean_m") for name in THREE}
    if len(errors["both"]) < 2:
        raise MissingRuns("a second seed, as one has no spread")
    better = min(THREE[:2], key=lambda name: float(np.mean(errors[name])))
    more = errors["both"] - errors[better]
    mean, chance = float(np.mean(more)), 2.0 * float(np.std(more, ddof=1)) / np.sqrt(len(more))
    means = ", ".join(
        f"{words} {_mm(errors[name])} (expected {_mm(column(runs, name, 'expected_m'))})"
        for name, words in zip(THREE, ("on board", "in the world", "both"), strict=True)
    )
    lucky = errors["both"] / np.minimum(errors["on_board"], errors["external"])
    return Finding(
        found=f"mean error of the pose over {len(more)} seeds: {means}; both less the better one "
        f"{1e3 * mean:+.1f} mm, by chance up to {1e3 * chance:.1f}; over the luckier one of each "
        f"seed {np.median(lucky):.2f} (median), {np.max(lucky):.2f} at most",
        held=[mean <= 0.0],
        some=mean <= chance,
    )


def _is_consistent(ends: Array) -> bool:
    """Whether normalized errors of six numbers are 6 in the mean, as far as so many tell."""
    return bool(abs(np.mean(ends) - 6.0) <= CONSISTENT * np.sqrt(12.0 / len(ends)))


@statement(
    "Either camera may fail for 3 s under way: the servo goes on and arrives.",
    rule=f"every servo ends within {1e3 * ARRIVED:g} mm; none stops for more than 0.1 s",
    cause=CHOICE,
    why=CHOSEN_SENSORS,
)
def survives_either_failure(runs: Runs) -> Finding:
    """Runs in which a camera fails for 3 s."""
    names = ("both, on_board covered", "both, external covered", "both, on_board frozen",
             "both, external off")  # fmt: skip
    ends = {name: column(runs, name, "servo_m") for name in names}
    still = {name: column(runs, name, "lost_s") for name in names}
    arrived = all(np.all(values <= ARRIVED) for values in ends.values())
    moving = all(np.all(values <= 0.1) for values in still.values())
    worst = ", ".join(f"{name[6:]} {1e3 * np.max(v):.2f} mm" for name, v in ends.items())
    return Finding(
        found=f"largest distance at the end: {worst}; longest stop "
        f"{max(float(np.max(v)) for v in still.values()):.2f} s",
        held=[arrived, moving],
    )


@statement(
    "The measurement accuracy of an external camera needs to be high for it to be beneficial; "
    "one that is 2 cm and 1 deg wrong is found out beside one on board.",
    source="servoing thesis, perspectives, chapter 2",
    rule=f"told that it may be wrong: at most {EQUAL:g} times the error of the right one on board "
    "alone, and found wrong with more than 50 %; in part: less error than untold",
    cause=CHOICE,
    why=CHOSEN_SENSORS,
)
def wrong_calibration_is_found(runs: Runs) -> Finding:
    """An external camera that is wrong in calibration."""
    names = ("both, external wrong", "both, external wrong, told", "both, external wrong, doubted")
    trusted, told, doubted = (column(runs, name, "mean_m") for name in names)
    alone, good = column(runs, "external wrong", "mean_m"), column(runs, "on_board", "mean_m")
    sure = np.mean(column(runs, names[1], "wrong_external"))
    return Finding(
        found=f"mean error of the pose: in the world alone {_mm(alone)}, both {_mm(trusted)}; told "
        f"that it may be so far off {_mm(told)}, found wrong with {sure:.0%}; either camera "
        f"doubted a little {_mm(doubted)}; on board alone, right, {_mm(good)}",
        held=[bool(np.mean(told) <= EQUAL * np.mean(good)), bool(sure > 0.5)],
        some=bool(np.mean(told) < np.mean(trusted)),
    )


@statement(
    "A camera in the world that is wrong does not move the target in the camera on board: a "
    "servo that sees the target arrives.",
    rule=f"every servo ends within {1e3 * ARRIVED:g} mm; in part: the median one",
    basis=OURS,
)
def wrong_calibration_costs_nothing(runs: Runs) -> Finding:
    """What a wrong external camera does to a servo that sees its target."""
    names = (*TOLD_WRONG, "both, external wrong", "both, external wrong, doubted",
             "both, external knocked", "both, external knocked, doubted")  # fmt: skip
    ends = {name: column(runs, name, "servo_m") for name in names}
    covered = column(runs, "both, external wrong, told, on_board covered", "servo_m")
    worst = max(float(np.max(values)) for values in ends.values())
    return Finding(
        found="largest distance at the end, wrong from the start or from 3 s on: "
        f"{1e3 * worst:.2f} mm; with the camera on board covered from 2 s to the end "
        f"{1e3 * np.mean(covered):.1f} mm ({1e3 * np.max(covered):.1f})",
        held=[float(np.max(values)) <= ARRIVED for values in ends.values()],
        some=float(np.median(list(ends.values()))) <= ARRIVED,
    )


@statement(
    "The filter is as uncertain as it is wrong: its normalized error squared is 6 in the mean.",
    rule=f"each within {CONSISTENT:g} standard deviations of a mean of so many chi-square numbers",
    basis=OURS,
)
def consistent(runs: Runs) -> Finding:
    """The filter's errors against its covariance."""
    words, good = [], []
    for name in (*THREE, "both, doubted", "both, external knocked, doubted", *TOLD_WRONG):
        ends = column(runs, name, "nees")
        good.append(_is_consistent(ends))
        words.append(f"{name} {np.mean(ends):.1f}")
    return Finding(
        found=f"at the end, {'; '.join(words)}; within "
        f"{CONSISTENT * np.sqrt(12.0 / len(ends)):.1f} for so many runs",
        held=good,
    )


@statement(
    "Sensor fusion can be useful: an IMU can provide the moving-platform orientation.",
    rule=IMPROVED,
    cause=CHOICE,
    why=CHOSEN_SENSORS,
)
def imu_improves_rotation(runs: Runs) -> Finding:
    """Rotation with and without an inertial sensor."""
    without, with_imu = (column(runs, name, "mean_rad") for name in ("external", "external, imu"))
    both, both_imu = (column(runs, name, "mean_rad") for name in ("both", "both, imu"))
    shares = [float(np.mean(b) / np.mean(a)) for a, b in ((without, with_imu), (both, both_imu))]
    return Finding(
        found=f"mean error of rotation with it over that without: in the world {shares[0]:.2f} "
        f"({np.degrees(np.mean(with_imu)):.2f} deg), both {shares[1]:.2f} "
        f"({np.degrees(np.mean(both_imu)):.2f} deg)",
        held=[share < BETTER for share in shares],
    )


@statement(
    "Sensor fusion can be useful: depth sensors can measure the distance along its axis.",
    rule=IMPROVED,
    cause=CHOICE,
    why=CHOSEN_SENSORS,
)
def depth_improves_position(runs: Runs) -> Finding:
    """Position along the axis with and without depths."""
    shares = [
        float(np.mean(column(runs, b, "mean_m")) / np.mean(column(runs, a, "mean_m")))
        for a, b in (("external", "external, depth"), ("both", "both, depth"))
    ]
    return Finding(
        found=f"mean error of position with depths of a Kinect over that without: in the world "
        f"{shares[0]:.2f}, both {shares[1]:.2f}",
        held=[share < BETTER for share in shares],
    )


def _slack(runs: Runs, way: str, surplus: float, key: str) -> Array:
    return runs(way=way, surplus_m=surplus)[key]


@statement(
    "By detecting the amount of slack on a cable the TCA correction rate can be adjusted to "
    "decrease a large slack more rapidly.",
    rule="8 cm are gone first of all ways, and in less than 0.6 of the time of the constant rate; "
    "in part: first",
    cause=CHOICE,
    why=CHOSEN_SENSORS,
)
def rate_by_seen_slack(runs: Runs) -> Finding:
    """Time to wind in slack at a rate from images."""
    times = {
        way: [float(np.mean(_slack(runs, way, length, "taut_s"))) for length in SURPLUSES]
        for way in WAYS
    }
    others = [times[way][-1] for way in WAYS if way != "image"]
    wrong = np.concatenate([_slack(runs, "image", length, "seen_error_m") for length in SURPLUSES])
    words = "; ".join(f"{k} {', '.join(f'{t:.2f}' for t in v)} s" for k, v in times.items())
    large, first = times["image"][-1], times["image"][-1] < min(others)
    return Finding(
        found=f"2, 4 and 8 cm gone after: {words}; seen slack is wrong by "
        f"{1e3 * np.nanmean(wrong):.1f} mm in the mean",
        held=[first, large < 0.6 * times["constant"][-1]],
        some=first,
    )


CHECKS = (
    both_as_good_as_the_better,
    survives_either_failure,
    wrong_calibration_is_found,
    wrong_calibration_costs_nothing,
    consistent,
    imu_improves_rotation,
    depth_improves_position,
    rate_by_seen_slack,
)
"""All statements of the study."""
