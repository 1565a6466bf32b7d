"""What the thesis states of slack on the mobile robot's track: when it is there, what it spoils."""

from __future__ import annotations

import numpy as np

from cdpr_drake.analyses.reporting.statements import Statement, verdict
from cdpr_drake.analyses.studies.framework.seeded_study import StudyData
from cdpr_drake.analyses.studies.mobile_robot.configurations import (
    NUMBERS,
    PUBLISHED_LAPS,
    VARIED,
    VARIED_ESTIMATORS,
)
from cdpr_drake.analyses.studies.mobile_robot.laps import (
    BEFORE,
    FREE,
    PHASES,
    REFERENCE,
    SLACK,
    TENSION_LAPS,
    failed,
)
from cdpr_drake.analyses.studies.mobile_robot.statements import (
    check_laps,
    column,
    laps_words,
    longer,
    median_laps,
    near,
)
from cdpr_drake.arrays import Array

BY_LENGTHS = tuple(PUBLISHED_LAPS)[1:]
"""Estimators 4 to 7."""

CORNERS = (0.1515, 0.3485, 0.6515, 0.8485)
"""Where in a lap the target is in the middle of a corner of the scenario's track, from 0 to 1."""

BEHIND = 0.1
"""How far behind the target, in laps, the platform counts as at a corner."""

SAME_PLACE = 0.7
"""Length of the mean of unit vectors at the phases of a lap, from which they are at one place: 1
where all are the same, 0 where they are all over the lap."""

NOTICED = 0.01
"""Change of the sum of lengths that can be seen in figure 5.21 [m]."""

USUAL = (1.0, 2.0)
"""Cables on the threshold, in the mean of a lap."""


def at_one_place(phases: Array) -> tuple[float, float]:
    """Mean of phases of a lap, from 0 to 1, and how much they are at one place, from 0 to 1."""
    mean = np.mean(np.exp(2j * np.pi * phases[np.isfinite(phases)]))
    return float(np.angle(mean) / (2.0 * np.pi) % 1.0), float(np.abs(mean))


def _ending(found: StudyData, name: str, key: str) -> Array:
    """A column in the lap in which each run that failed did so, shape (runs that failed,)."""
    values, ends = column(found, name, key), found[name]["end"]
    rows = [values[k][np.isfinite(values[k])] for k in np.flatnonzero(failed(ends))]
    return np.array([row[-1] for row in rows if len(row)])


def _fails_far_off(found: StudyData) -> Statement:
    """How far off control integration is when the task fails."""
    name = "estimator control_integration"
    away, turned = _ending(found, name, "estimate_m"), _ending(found, name, "estimate_rad")
    if not len(away):
        raise KeyError("no run failed")
    far, angle = float(np.median(away)), float(np.degrees(np.median(turned)))
    return Statement(
        "By control integration the task only fails after an error of almost 0.3 m and 15 deg.",
        "section 2.4",
        f"{far:.2f} m and {angle:.1f} deg in the lap in which it fails (medians)",
        verdict(near(far, 0.3) and near(angle, 15.0), near(far, 0.3) or near(angle, 15.0)),
    )


def _far_surpasses(found: StudyData) -> Statement:
    """Errors by control integration against those by lengths."""
    worst = {k: float(np.nanmax(column(found, f"estimator {k}", "estimate_m")))
             for k in PUBLISHED_LAPS}  # fmt: skip
    first = worst.pop("control_integration")
    return Statement(
        "The error by control integration far surpasses that of the estimators by lengths.",
        "figure 2.16c",
        f"largest {first:.2f} m; by lengths "
        + ", ".join(f"{NUMBERS[k]}: {value:.2f} m" for k, value in worst.items()),
        verdict(first > 2.0 * max(worst.values()), first > max(worst.values())),
        "Far: twice.",
    )


def _spikes(found: StudyData) -> Statement:
    """Where on the track errors by lengths have spikes."""
    check_laps(found, f"estimator {BY_LENGTHS[0]}", REFERENCE)
    places, sharp = {}, {}
    for kind in BY_LENGTHS:
        name = f"estimator {kind}"
        whole = np.isfinite(column(found, name, "path_at"))
        error = column(found, name, "estimate_m")
        later = whole & (error >= np.nanmedian(error[whole]))
        places[kind], sharp[kind] = at_one_place(column(found, name, "estimate_at")[later])
    words = [f"{NUMBERS[k]}: {places[k]:.2f} of the lap ({sharp[k]:.2f})" for k in BY_LENGTHS]
    together = at_one_place(np.array(list(places.values())))[1]
    fixed = [value >= SAME_PLACE for value in sharp.values()]
    return Statement(
        "By lengths the errors have spikes always at the same place of the track, by all "
        "estimators at the same time.",
        "figure 2.17, t = 8, 24, 42 s: 0.5 of the lap",
        "; ".join(words) + f"; the four together ({together:.2f})",
        verdict(all(fixed) and together >= SAME_PLACE, any(fixed)),
        "Where laps of at least median error are worst; in brackets how much they agree, 0 to 1: "
        f"below {SAME_PLACE:g} it is no one place. Where slack goes from cable to cable depends on "
        "how each winch runs off, which is drawn for each run; the printed figure is of one.",
    )


def _spikes_by_slack(found: StudyData) -> Statement:
    """Slack at the spikes of estimates by lengths."""
    check_laps(found, f"estimator {BY_LENGTHS[0]}", REFERENCE)
    most = {k: _ending(found, f"estimator {k}", "slack_at_estimate") for k in BY_LENGTHS}
    words = [f"{NUMBERS[k]}: {int(np.sum(v > FREE))} of {len(v)}" for k, v in most.items()]
    shares = [float(np.mean(values > FREE)) for values in most.values() if len(values)]
    if not shares:
        raise KeyError("no run failed")
    return Statement(
        "Estimates by lengths go wrong where slack is transferred between cables: more than two "
        "are slack for a moment, and a slack one is used.",
        "figures 2.17, 2.18",
        "runs in which more than two were slack when the estimate was worst, in the last lap: "
        + "; ".join(words),
        verdict(min(shares) > 0.5, max(shares) > 0.5),
        f"In the {BEFORE:g} s before; confirmed: in most runs by each estimator.",
    )


def _worse_and_worse(found: StudyData) -> Statement:
    """How fast the path gets worse without correction."""
    away = column(found, "plain", "path_m")
    there = np.isfinite(away[:, 23]) if away.shape[1] > 23 else np.zeros(0, bool)
    if not np.any(there):
        raise KeyError("no run came to lap 24")
    early, late = away[there, 19], away[there, 23] - away[there, 19]
    ratio = float(np.median(late / early))
    return Statement(
        "Without correction the path becomes worse faster and faster: from lap 20 to 24 about as "
        "much as from lap 10 to 20.",
        "figure 5.19",
        f"{1e3 * np.median(early):.0f} mm from lap {REFERENCE} to 20, "
        f"{1e3 * np.median(late):.0f} mm more by lap 24 (medians of {int(np.sum(there))} runs)",
        verdict(near(ratio, 1.0), ratio > 0.4),
        "In part: faster than in proportion to the laps. Runs that failed before lap 24 are not in "
        "it.",
    )


def _corners(found: StudyData) -> Statement:
    """Where the path deviates without correction."""
    where = _ending(found, "plain", "path_at")
    ends = found["plain"]["end"]
    if not len(where):
        raise KeyError("no run failed")
    inside = np.array(
        [any(0.0 <= phase - middle <= BEHIND for middle in CORNERS) for phase in where]
    )
    share = BEHIND * len(CORNERS)
    return Statement(
        "The sharp deviations without correction are on the farthest corners of the track.",
        "figure 5.19",
        f"{int(np.sum(inside))} of {len(ends)} runs are farthest away at a corner, in the last "
        f"whole lap; corners take {100 * share:.0f} % of it",
        verdict(bool(np.all(inside)), float(np.mean(inside)) > share),
    )


def _noticed_early(found: StudyData) -> Statement:
    """Sum of lengths by lap 10."""
    check_laps(found, "plain", REFERENCE)
    sums = found["plain"]["sums"]
    rise = np.nanmax(sums[:, REFERENCE - 1] - sums[:, 1], axis=1)
    return Statement(
        "Without correction the sum of lengths has grown noticeably by lap 10.",
        "figure 5.21",
        f"{1e3 * np.nanmedian(rise):.0f} mm since lap 2 (median), at least "
        f"{1e3 * np.nanmin(rise):.0f} mm",
        verdict(bool(np.nanmin(rise) > NOTICED), bool(np.nanmedian(rise) > NOTICED)),
        f"Noticeably: {1e3 * NOTICED:g} mm.",
    )


def _first_laps(found: StudyData) -> Statement:
    """Slack cables without correction, by lap."""
    check_laps(found, "plain", 20)
    one, two = (column(found, "plain", key) for key in ("one_slack", "two_slack"))
    some, always = float(np.nanmedian(one[:, 0])), [float(np.nanmedian(two[:, k])) for k in (9, 19)]
    first = some > 0.5
    return Statement(
        "Without correction one cable is slack for most of the first lap, sometimes two; in laps "
        "10 and 20 two are slack all the time.",
        "figure 5.22",
        f"lap 1: one or more for {100 * some:.0f} %, two or more for "
        f"{100 * np.nanmedian(two[:, 0]):.0f} % of it; two or more in lap 10 for "
        f"{100 * always[0]:.0f} %, in lap 20 for {100 * always[1]:.0f} % (medians)",
        verdict(first and min(always) > 0.95, first or min(always) > 0.95),
        f"A cable is slack below {SLACK:g} N; all the time: 95 %.",
    )


def _underactuated(found: StudyData) -> Statement:
    """How long the platform is underactuated in lap 20."""
    check_laps(found, "plain", 20)
    longest = column(found, "plain", "underactuated_s")[:, 19]
    there = longest[np.isfinite(longest)]
    if not len(there):
        raise KeyError("no run came to lap 20")
    time = float(np.median(there))
    return Statement(
        "In lap 20 the transfer of slack leaves the platform underactuated for 1 s.",
        "figure 5.22c",
        f"{time:.1f} s (median of {len(there)} runs, longest {np.max(there):.1f} s)",
        verdict(near(time, 1.0), time > 0.0),
    )


def _last_seconds(found: StudyData) -> Statement:
    """Slack cables before a failure."""
    plain = found["plain"]
    ended = plain["underactuated_at_end"][failed(plain["end"]), 0]
    if not len(ended):
        raise KeyError("no run failed")
    return Statement(
        "Without correction more than two cables are slack for the last six seconds, which leads "
        "to failure.",
        "figure 5.22d",
        f"{np.median(ended):.1f} s before the end (median), in {int(np.sum(ended > 0.0))} of "
        f"{len(ended)} runs that failed",
        verdict(near(float(np.median(ended)), 6.0), bool(np.median(ended) > 0.0)),
        "The run goes on for 2 s after the target is lost.",
    )


def _takes_part(found: StudyData) -> Statement:
    """How often correction acts."""
    check_laps(found, "corrected", REFERENCE)
    mean = column(found, "corrected", "at_threshold")[:, 1:]
    low, high = float(np.nanmin(mean)), float(np.nanmax(mean))
    middle = float(np.nanmedian(mean))
    least = float(np.nanmedian(np.nanmin(found["corrected"]["tensions"], axis=-1)))
    return Statement(
        "Correction takes part in every lap: usually one or two tensions are on the threshold.",
        "figure 5.23",
        f"{middle:.1f} in the mean of a lap (median; from {low:.1f} to {high:.1f})",
        verdict(USUAL[0] <= middle <= USUAL[1] and low > 0.0, low > 0.0),
        f"Within {SLACK:g} N of the threshold. The least tension at a moment is {least:.1f} N in "
        "the median: the correction winds up and never pays out, and a cable that it has tightened "
        "stays above the threshold until the winches' running off brings one down to it again.",
    )


def _same_tensions(found: StudyData) -> Statement:
    """Tensions of laps 10, 30 and 700."""
    columns = [TENSION_LAPS.index(10), TENSION_LAPS.index(30), len(TENSION_LAPS)]
    tensions = found["corrected"]["tensions"][:, columns]
    if not np.all(np.isfinite(tensions)):
        raise KeyError("laps are missing")

    def apart(one: int, other: int) -> float:
        change = tensions[:, one] - tensions[:, other]
        return float(np.sqrt(np.mean(change**2)))

    soon, late = apart(0, 1), apart(0, 2)
    return Statement(
        "With correction tensions are the same in laps 10, 30 and 700.",
        "figure 5.23",
        f"rms difference of lap 30 from lap 10 {soon:.2f} N, of the last lap {late:.2f} N, at "
        f"{PHASES} moments of a lap",
        verdict(late <= max(2.0 * soon, SLACK), late <= 4.0 * soon),
        "The same: twice what laps 10 and 30 differ by, or the accuracy of the sensors.",
    )


def _only_the_first(found: StudyData) -> Statement:
    """The first lap's path with correction."""
    check_laps(found, "corrected", REFERENCE)
    away = column(found, "corrected", "path_m")
    first, later = float(np.nanmedian(away[:, 0])), float(np.nanmedian(away[:, 1:]))
    return Statement(
        "With correction only the first lap's path differs, as the task begins there.",
        "figure 5.20",
        f"{1e3 * first:.1f} mm from lap {REFERENCE} in lap 1, {1e3 * later:.1f} mm in others "
        "(medians)",
        verdict(first > 2.0 * later, first > later),
    )


def _lengths_depend(found: StudyData) -> Statement:
    """How long estimators 4 and 7 last under other choices."""
    words, good = [], {}
    names = {"as chosen": "", **{name: f"{name}, " for name in VARIED}}
    for name, prefix in names.items():
        laps = {k: median_laps(found, f"{prefix}estimator {k}") for k in VARIED_ESTIMATORS}
        label = VARIED[name][0] if name in VARIED else name
        ends = {NUMBERS[k]: found[f"{prefix}estimator {k}"]["end"] for k in laps}
        words.append(f"{label}: " + ", ".join(f"{n}: {laps_words(e)}" for n, e in ends.items()))
        good[name] = [near(laps[k], PUBLISHED_LAPS[k]) for k in laps]
    medians = {n: median_laps(found, f"{p}estimator cable_lengths") for n, p in names.items()}
    most, least = max(medians, key=medians.__getitem__), min(medians, key=medians.__getitem__)
    helps = longer(medians[most], medians["as chosen"]) or medians[least] < medians["as chosen"]
    return Statement(
        "How long estimators 4 and 7 last is decided by what is not printed.",
        "4: 2, 7: 4",
        "; ".join(words),
        verdict(any(all(pair) for pair in good.values()), any(map(any, good.values())) or helps),
        "Confirmed: with one choice both agree with the thesis; estimator 4 lasts longest with "
        f"{VARIED[most][0] if most in VARIED else most}, shortest with "
        f"{VARIED[least][0] if least in VARIED else least}.",
    )


CHECKS = (
    _fails_far_off, _far_surpasses, _spikes, _spikes_by_slack, _lengths_depend, _worse_and_worse,
    _corners, _noticed_early, _first_laps, _underactuated, _last_seconds, _takes_part,
    _same_tensions, _only_the_first,
)  # fmt: skip
"""Judges of slack, and of what follows from it."""
