"""What the thesis states of the mobile robot, and whether it is so here."""

from __future__ import annotations

from functools import partial

import numpy as np

from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Runs
from cdpr_drake.analyses.studies.framework.statement import (
    FITTED,
    OURS,
    SOURCE,
    Finding,
    statement,
)
from cdpr_drake.analyses.studies.mobile_robot.configurations import (
    ALL_LAPS,
    CORRECTED,
    NUMBERS,
    PLAIN_RUN,
    PUBLISHED_LAPS,
    PUBLISHED_PLAIN,
    VARIED,
)
from cdpr_drake.analyses.studies.mobile_robot.laps import FREE, REFERENCE
from cdpr_drake.arrays import Array

NOT_PRINTED = (
    "Track, friction, how far the tag may drift in the image, and by how much winches run off are "
    "not printed; what other choices change was tried, see the statements of ours."
)

of_estimators = partial(statement, source="servoing thesis 2.3.7", cause=SOURCE, why=NOT_PRINTED)
of_tracking = partial(statement, source="servoing thesis 5.3.1", cause=SOURCE, why=NOT_PRINTED)

FACTOR = 2.0
"""Laps within this factor of the published ones agree with them: one run was made of each."""

LENGTH_FACTOR = 2.0
"""The same of lengths."""

SAME_PATH = 0.01
"""How far a path may be from that of lap 10 to be the same [m]: what the estimate's jump at the
known tag moves the platform by."""


def column(runs: Runs, name: str, key: str) -> np.ndarray:
    """A column of a configuration, shape (runs, ...), such as (runs, laps)."""
    return runs(configuration=name)[key]


def check_laps(runs: Runs, name: str, lap: int) -> None:
    """Raises MissingRuns where runs of a configuration were not asked to come to a lap, from 1."""
    if runs(configuration=name).smallest("asked_laps") < lap:
        raise MissingRuns(f"{name}: runs of less than {lap} laps")


def laps_words(runs: Runs) -> str:
    """Laps until failure of runs, such as `median 12.4 (3.9 to 20.0), 2 of 10 did not fail`."""
    laps, bad = runs["laps_done"], runs["failed"]
    words = f"median {np.median(laps):.1f} ({np.min(laps):.1f} to {np.max(laps):.1f})"
    return words + ("" if np.all(bad) else f", {int(np.sum(~bad))} of {len(bad)} did not fail")


def median_laps(runs: Runs, name: str) -> float:
    """Median of the laps until runs ended; infinite where most did not fail."""
    some = runs(configuration=name)
    return float(np.median(np.where(some["failed"], some["laps_done"], np.inf)))


def near(value: float, published: float, factor: float = FACTOR) -> bool:
    """Whether a number agrees with a published one."""
    return published / factor <= value <= factor * published


def longer(one: float, other: float, times: float = 1.0) -> bool:
    """Whether laps are more than others, so many times; nobody knows if the others do not end."""
    return bool(np.isfinite(other) and one > times * other)


@of_estimators(
    "Without a known tag tracking fails after some laps, by each estimator.",
    ", ".join(f"{NUMBERS[k]}: {laps}" for k, laps in PUBLISHED_LAPS.items()),
    rule=f"each median within a factor {FACTOR:g}",
    basis=FITTED,
    cause=SOURCE,
)
def estimators(runs: Runs) -> Finding:
    """How long each estimator is followed without a known tag."""
    medians = {k: median_laps(runs, f"estimator {k}") for k in PUBLISHED_LAPS}
    good = [near(medians[k], laps) for k, laps in PUBLISHED_LAPS.items()]
    words = [
        f"{NUMBERS[k]}: {laps_words(runs(configuration=f'estimator {k}'))}" for k in PUBLISHED_LAPS
    ]  # fmt: skip
    return Finding(
        found="; ".join(words),
        held=good,
        why="What winches run off was fitted to a drift in 12 laps.",
    )


@of_estimators(
    "Control integration lasts longest, three times as long as the best by lengths.",
    "12 laps and 4",
    rule=f"medians, {3.0 / FACTOR:g} times as long; in part: longer",
    basis=FITTED,
    cause=SOURCE,
)
def integration_lasts(runs: Runs) -> Finding:
    """Laps until failure, control integration against cable lengths."""
    medians = {k: median_laps(runs, f"estimator {k}") for k in PUBLISHED_LAPS}
    first = medians.pop("control_integration")
    return Finding(
        found=f"{first:.1f} laps and {max(medians.values()):.1f}",
        held=[longer(first, max(medians.values()), 3.0 / FACTOR)],
        some=longer(first, max(medians.values())),
        why="Medians; inf: most runs did not fail. Winches run off as was fitted to the drift of "
        "control integration, and encoders see that: estimates by lengths keep what integration "
        "loses. What made them fail within 4 laps is not printed; of size and distance of the tag "
        "see view_decides, of other choices lengths_depend.",
    )


@of_estimators(
    "By cable lengths, the more the model knows, the later it fails.",
    "4: 2, 5 and 6: 3, 7: 4",
    rule="medians; in part: 7 lasts longer than 4",
)
def model_helps(runs: Runs) -> Finding:
    """Laps until failure against what the model knows."""
    four, five, six, seven = (median_laps(runs, f"estimator {k}") for k in list(PUBLISHED_LAPS)[1:])
    return Finding(
        found=f"4: {four:.1f}, 5: {five:.1f}, 6: {six:.1f}, 7: {seven:.1f}",
        held=[four < min(five, six), seven > max(five, six)],
        some=four < seven,
        why="Medians; inf: most runs did not fail, and which of such lasts longer is not known.",
    )


@of_estimators(
    "The estimate by control integration drifts smoothly, along z by almost 0.3 m in 12 laps; "
    "those by lengths have spikes.",
    "figures 2.16, 2.17",
    rule=f"the drift within a factor {FACTOR:g}; smoother than by lengths; in part: the second",
    basis=FITTED,
)
def drift(runs: Runs) -> Finding:
    """How estimates drift."""
    name = "estimator control_integration"
    high, error = column(runs, name, "estimate_z_m"), column(runs, name, "estimate_m")
    at = min(12, high.shape[1]) - 1
    last = high[:, at][np.isfinite(high[:, at])]
    steps = np.diff(error, axis=1)
    by_lengths = np.diff(column(runs, "estimator cable_lengths_elastic_pulleys", "estimate_m"))
    smooth = float(np.nanmax(np.abs(steps[:, : at - 1])))
    rough = float(np.nanmax(np.abs(by_lengths)))
    mean = float(np.median(last)) if len(last) else float("nan")
    return Finding(
        found=f"{mean:.2f} m at the end of lap {at + 1}; largest change from lap to lap "
        f"{smooth:.3f} m, estimator 7 {rough:.3f} m",
        held=[near(mean, 0.3), smooth < rough],
        some=smooth < rough,
        why="What the winches run off was fitted to the first number.",
    )


@of_tracking(
    "With a known tag each lap and no correction, tracking fails in lap 29, just under ten "
    "minutes.",
    "lap 29",
    rule=f"median within a factor {FACTOR:g}; in part: any fails",
    cause=SOURCE,
)
def plain(runs: Runs) -> Finding:
    """When tracking fails with a known tag and no correction."""
    plain = runs(configuration=PLAIN_RUN)
    check_laps(runs, PLAIN_RUN, PUBLISHED_PLAIN)
    return Finding(
        found=laps_words(plain),
        held=[near(median_laps(runs, PLAIN_RUN), PUBLISHED_PLAIN)],
        some=bool(np.any(plain["failed"])),
        why=f"Runs end after {plain.rows[0]['asked_laps']} laps, failed or not; how long they "
        "last depends on by what the winches run off, which is not printed.",
    )


@of_tracking(
    "The known tag triples the time until failure.",
    "210 s and just under ten minutes",
    rule=f"medians, {3.0 / FACTOR:g} times as long; in part: longer",
)
def known_tag_helps(runs: Runs) -> Finding:
    """Time until failure with and without a known tag."""
    one, other = (median_laps(runs, n) for n in (PLAIN_RUN, "estimator control_integration"))
    return Finding(
        found=f"{16.0 * other:.0f} s and {16.0 * one:.0f} s (medians)",
        held=[longer(one, other, 3.0 / FACTOR)],
        some=longer(one, other),
        why="With it the slack decides when a run fails, without "
        "it the drift, too; by how much winches differ, which decides the former, is chosen.",
    )


def rises(sums: Array, early: int, late: int) -> Array:
    """Largest rise of the sum of lengths from one lap, counted from 1, to another, shape (runs,)
    [m], at the same moment of the lap; NaN where there is no such lap."""
    if late > sums.shape[1]:
        return np.full(len(sums), np.nan)
    change = sums[:, late - 1] - sums[:, early - 1]
    whole = np.all(np.isfinite(change), axis=1)
    return np.where(whole, np.max(change, axis=1), np.nan)


@of_tracking(
    "Without correction the sum of the cables' lengths grows by 0.15 m from lap 10 to lap 20 "
    "and by 0.3 m more until lap 29, at the worst moment.",
    "figure 5.21",
    rule=f"medians within a factor {LENGTH_FACTOR:g}; in part: one, or any growth",
    basis=FITTED,
)
def lengths(runs: Runs) -> Finding:
    """How much longer the cables get without correction."""
    sums = column(runs, PLAIN_RUN, "sums_m")
    to_20 = rises(sums, REFERENCE, 20)
    ends = np.clip(column(runs, PLAIN_RUN, "laps_done").astype(int), 1, sums.shape[1])
    from_20 = np.array([
        float(np.nanmax(sums[k, end - 1] - sums[k, 19]))
        if end > 20 and np.any(np.isfinite(sums[k, end - 1])) else np.nan
        for k, end in enumerate(ends)
    ])  # fmt: skip
    there, later = to_20[np.isfinite(to_20)], from_20[np.isfinite(from_20)]
    if len(there) == 0:
        raise MissingRuns("no run came to lap 20")
    words = f"{np.median(there):.3f} m by lap 20 in {len(there)} runs that came so far"
    if len(later):
        words += f"; {np.median(later):.3f} m more until the last lap in {len(later)}"
    good = near(float(np.median(there)), 0.15, LENGTH_FACTOR)
    more = len(later) > 0 and near(float(np.median(later)), 0.3, LENGTH_FACTOR)
    return Finding(
        found=words,
        held=[good, more],
        some=good or more or float(np.median(there)) > 0.0,
        why="By how much the winches differ was chosen with the first number in sight.",
    )


@of_tracking(
    "With correction the robot is followed for 700 laps, 180 minutes.",
    f"{ALL_LAPS} laps",
    rule="all runs come to their end, which is lap 700; in part: the first",
)
def corrected(runs: Runs) -> Finding:
    """How long the robot is followed with correction."""
    whole, seen = (~column(runs, CORRECTED, "failed"), column(runs, CORRECTED, "seen"))
    laps = seen.shape[1]
    return Finding(
        found=f"{int(np.sum(whole))} of {len(whole)} runs came to lap {laps}; least share of "
        f"images with the tag in a lap after the first {np.nanmin(seen[:, 1:]):.3f}",
        held=[bool(np.all(whole)), laps >= ALL_LAPS],
        some=bool(np.all(whole)),
        why=f"In part: all runs came to their end, which is lap {laps} here."
        if laps < ALL_LAPS
        else "",
    )


@of_tracking(
    "With correction never more than two cables are slack.",
    f"{FREE}",
    rule="in no run, in 700 laps; in part: in no run",
)
def slack(runs: Runs) -> Finding:
    """How many cables are slack with correction."""
    most = column(runs, CORRECTED, "most_slack")
    laps, never = most.shape[1], bool(np.nanmax(most) <= FREE)
    return Finding(
        found=f"at most {int(np.nanmax(most))} in {laps} laps",
        held=[never, laps >= ALL_LAPS],
        some=never,
        why=f"In part: runs are of {laps} laps here." if laps < ALL_LAPS else "",
    )


@of_tracking(
    "With correction the path stays almost exactly that of lap 10, without it gets worse.",
    "figures 5.19, 5.20",
    rule=f"within {1e3 * SAME_PATH:g} mm; without correction farther",
)
def same_path(runs: Runs) -> Finding:
    """Paths of later laps, with correction and without."""
    away = column(runs, CORRECTED, "path_m")
    if not np.any(np.isfinite(away[:, REFERENCE:])):
        raise MissingRuns("no lap after the one that is compared with")
    later = float(np.nanmax(away[:, REFERENCE:]))
    plain = column(runs, PLAIN_RUN, "path_m")
    worse = (
        float(np.nanmax(plain[:, REFERENCE:]))
        if np.any(np.isfinite(plain[:, REFERENCE:])) else float("nan")
    )  # fmt: skip
    return Finding(
        found=f"at most {1e3 * later:.1f} mm away with correction, {1e3 * worse:.1f} mm without",
        held=[later <= SAME_PATH, worse > later],
    )


@statement(
    "Track, friction, and by how much winches run off are not printed.",
    "nothing",
    rule="with correction all runs go to the end, whatever was chosen",
    basis=OURS,
)
def depends(runs: Runs) -> Finding:
    """Results under other choices of what is not printed."""
    words, lasts = [], []
    for name, (label, _, _) in VARIED.items():
        plain = runs(configuration=f"{name}, {PLAIN_RUN}")
        held = ~column(runs, f"{name}, {CORRECTED}", "failed")
        words.append(
            f"{label}: {laps_words(plain)}; corrected {int(np.sum(held))} of {len(held)} to the end"
        )
        lasts.append(bool(np.all(held)))
    return Finding(
        found="; ".join(words),
        held=lasts,
    )


CHECKS = (
    estimators, integration_lasts, model_helps, drift, plain, known_tag_helps, lengths,
    corrected, slack, same_path, depends,
)  # fmt: skip
"""Judges of laps, lengths and paths."""
