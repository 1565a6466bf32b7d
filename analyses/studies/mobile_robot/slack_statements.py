"""What the thesis states of slack on the mobile robot's track: when it is there, what it spoils."""

from __future__ import annotations

import numpy as np

from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Runs
from cdpr_drake.analyses.studies.framework.statement import FITTED, OURS, SOURCE, Finding, statement
from cdpr_drake.analyses.studies.mobile_robot.configurations import (
    CORRECTED,
    NUMBERS,
    PLAIN_RUN,
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
)
from cdpr_drake.analyses.studies.mobile_robot.statements import (
    FACTOR,
    NOT_PRINTED,
    check_laps,
    column,
    laps_words,
    longer,
    median_laps,
    near,
    of_estimators,
    of_tracking,
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


def _ending(runs: Runs, name: str, key: str) -> Array:
    """A column in the lap in which each run that failed did so, shape (runs that failed,)."""
    values = runs(configuration=name)(failed=True).list(key)
    rows = [value[np.isfinite(value)] for value in values]
    return np.array([row[-1] for row in rows if len(row)])


@statement(
    "By control integration the task only fails after an error of almost 0.3 m and 15 deg.",
    "section 2.4",
    source="servoing thesis 2.4",
    rule=f"each within a factor {FACTOR:g}",
    cause=SOURCE,
    why=NOT_PRINTED,
)
def fails_far_off(runs: Runs) -> Finding:
    """How far off control integration is when the task fails."""
    name = "estimator control_integration"
    away, turned = _ending(runs, name, "estimate_m"), _ending(runs, name, "estimate_rad")
    if not len(away):
        raise MissingRuns("no run failed")
    far, angle = float(np.median(away)), float(np.degrees(np.median(turned)))
    return Finding(
        found=f"{far:.2f} m and {angle:.1f} deg in the lap in which it fails (medians)",
        held=[near(far, 0.3), near(angle, 15.0)],
    )


@of_estimators(
    "The error by control integration far surpasses that of the estimators by lengths.",
    "figure 2.16c",
    rule="far: twice; in part: more",
)
def far_surpasses(runs: Runs) -> Finding:
    """Errors by control integration against those by lengths."""
    worst = {k: float(np.nanmax(column(runs, f"estimator {k}", "estimate_m")))
             for k in PUBLISHED_LAPS}  # fmt: skip
    first = worst.pop("control_integration")
    return Finding(
        found=f"largest {first:.2f} m; by lengths "
        + ", ".join(f"{NUMBERS[k]}: {value:.2f} m" for k, value in worst.items()),
        held=[first > 2.0 * max(worst.values())],
        some=first > max(worst.values()),
    )


@of_estimators(
    "By lengths the errors have spikes always at the same place of the track, by all "
    "estimators at the same time.",
    "figure 2.17, t = 8, 24, 42 s: 0.5 of the lap",
    rule=f"they agree by at least {SAME_PLACE:g}, by each and of the four; in part: by any",
)
def spikes(runs: Runs) -> Finding:
    """Where on the track errors by lengths have spikes."""
    check_laps(runs, f"estimator {BY_LENGTHS[0]}", REFERENCE)
    places, sharp = {}, {}
    for kind in BY_LENGTHS:
        name = f"estimator {kind}"
        whole = np.isfinite(column(runs, name, "path_at"))
        error = column(runs, name, "estimate_m")
        later = whole & (error >= np.nanmedian(error[whole]))
        places[kind], sharp[kind] = at_one_place(column(runs, name, "estimate_at")[later])
    words = [f"{NUMBERS[k]}: {places[k]:.2f} of the lap ({sharp[k]:.2f})" for k in BY_LENGTHS]
    together = at_one_place(np.array(list(places.values())))[1]
    fixed = [value >= SAME_PLACE for value in sharp.values()]
    return Finding(
        found="; ".join(words) + f"; the four together ({together:.2f})",
        held=[*fixed, together >= SAME_PLACE],
        some=any(fixed),
        why="Where laps of at least median error are worst; in brackets how much they agree, 0 to "
        f"1: below {SAME_PLACE:g} it is no one place. Where slack goes from cable to cable depends "
        "on how each winch runs off, which is drawn for each run; the printed figure is of one.",
    )


@of_estimators(
    "Estimates by lengths go wrong where slack is transferred between cables: more than two "
    "are slack for a moment, and a slack one is used.",
    "figures 2.17, 2.18",
    rule=f"in the {BEFORE:g} s before, in most runs, by each estimator",
)
def spikes_by_slack(runs: Runs) -> Finding:
    """Slack at the spikes of estimates by lengths."""
    check_laps(runs, f"estimator {BY_LENGTHS[0]}", REFERENCE)
    most = {k: _ending(runs, f"estimator {k}", "slack_at_estimate") for k in BY_LENGTHS}
    words = [f"{NUMBERS[k]}: {int(np.sum(v > FREE))} of {len(v)}" for k, v in most.items()]
    shares = [float(np.mean(values > FREE)) for values in most.values() if len(values)]
    if not shares:
        raise MissingRuns("no run failed")
    return Finding(
        found="runs in which more than two were slack when the estimate was worst, in the last "
        "lap: " + "; ".join(words),
        held=[share > 0.5 for share in shares],
    )


@of_tracking(
    "Without correction the path becomes worse faster and faster: from lap 20 to 24 about as "
    "much as from lap 10 to 20.",
    "figure 5.19",
    rule=f"within a factor {FACTOR:g}; in part: faster than in proportion to the laps",
)
def worse_and_worse(runs: Runs) -> Finding:
    """How fast the path gets worse without correction."""
    away = column(runs, PLAIN_RUN, "path_m")
    there = np.isfinite(away[:, 23]) if away.shape[1] > 23 else np.zeros(0, bool)
    if not np.any(there):
        raise MissingRuns("no run came to lap 24")
    early, late = away[there, 19], away[there, 23] - away[there, 19]
    ratio = float(np.median(late / early))
    return Finding(
        found=f"{1e3 * np.median(early):.0f} mm from lap {REFERENCE} to 20, "
        f"{1e3 * np.median(late):.0f} mm more by lap 24 (medians of {int(np.sum(there))} runs)",
        held=[near(ratio, 1.0)],
        some=ratio > 0.4,
        why="Runs that failed before lap 24 are not in it.",
    )


@of_tracking(
    "The sharp deviations without correction are on the farthest corners of the track.",
    "figure 5.19",
    rule="each run; in part: more than corners take of a lap",
)
def corners(runs: Runs) -> Finding:
    """Where the path deviates without correction."""
    where = _ending(runs, PLAIN_RUN, "path_at")
    count = len(runs(configuration=PLAIN_RUN))
    if not len(where):
        raise MissingRuns("no run failed")
    inside = np.array(
        [any(0.0 <= phase - middle <= BEHIND for middle in CORNERS) for phase in where]
    )
    share = BEHIND * len(CORNERS)
    return Finding(
        found=f"{int(np.sum(inside))} of {count} runs are farthest away at a corner, in the "
        f"last whole lap; corners take {100 * share:.0f} % of it",
        held=inside.tolist(),
        some=float(np.mean(inside)) > share,
    )


@of_tracking(
    "Without correction the sum of lengths has grown noticeably by lap 10.",
    "figure 5.21",
    rule=f"noticeably: {1e3 * NOTICED:g} mm, in each run; in part: in the median",
    basis=FITTED,
)
def noticed_early(runs: Runs) -> Finding:
    """Sum of lengths by lap 10."""
    check_laps(runs, PLAIN_RUN, REFERENCE)
    sums = column(runs, PLAIN_RUN, "sums_m")
    rise = np.nanmax(sums[:, REFERENCE - 1] - sums[:, 1], axis=1)
    return Finding(
        found=f"{1e3 * np.nanmedian(rise):.0f} mm since lap 2 (median), at least "
        f"{1e3 * np.nanmin(rise):.0f} mm",
        held=[bool(np.nanmin(rise) > NOTICED)],
        some=bool(np.nanmedian(rise) > NOTICED),
        why="By how much the winches differ was chosen with another number of the figure in sight.",
    )


@of_tracking(
    "Without correction one cable is slack for most of the first lap, sometimes two; in laps "
    "10 and 20 two are slack all the time.",
    "figure 5.22",
    rule=f"a cable is slack below {SLACK:g} N; most: half; all the time: 95 %",
)
def first_laps(runs: Runs) -> Finding:
    """Slack cables without correction, by lap."""
    check_laps(runs, PLAIN_RUN, 20)
    one, two = (column(runs, PLAIN_RUN, key) for key in ("one_slack", "two_slack"))
    some, always = float(np.nanmedian(one[:, 0])), [float(np.nanmedian(two[:, k])) for k in (9, 19)]
    first = some > 0.5
    return Finding(
        found=f"lap 1: one or more for {100 * some:.0f} %, two or more for "
        f"{100 * np.nanmedian(two[:, 0]):.0f} % of it; two or more in lap 10 for "
        f"{100 * always[0]:.0f} %, in lap 20 for {100 * always[1]:.0f} % (medians)",
        held=[first, *(share > 0.95 for share in always)],
        some=first or min(always) > 0.95,
    )


@of_tracking(
    "In lap 20 the transfer of slack leaves the platform underactuated for 1 s.",
    "figure 5.22c",
    rule=f"median within a factor {FACTOR:g}; in part: at all",
)
def underactuated(runs: Runs) -> Finding:
    """How long the platform is underactuated in lap 20."""
    check_laps(runs, PLAIN_RUN, 20)
    longest = column(runs, PLAIN_RUN, "underactuated_s")[:, 19]
    there = longest[np.isfinite(longest)]
    if not len(there):
        raise MissingRuns("no run came to lap 20")
    time = float(np.median(there))
    return Finding(
        found=f"{time:.1f} s (median of {len(there)} runs, longest {np.max(there):.1f} s)",
        held=[near(time, 1.0)],
        some=time > 0.0,
    )


@of_tracking(
    "Without correction more than two cables are slack for the last six seconds, which leads "
    "to failure.",
    "figure 5.22d",
    rule=f"median within a factor {FACTOR:g}; in part: at all",
)
def last_seconds(runs: Runs) -> Finding:
    """Slack cables before a failure."""
    ended = runs(configuration=PLAIN_RUN)(failed=True)["underactuated_at_end_s"]
    if not len(ended):
        raise MissingRuns("no run failed")
    return Finding(
        found=f"{np.median(ended):.1f} s before the end (median), in {int(np.sum(ended > 0.0))} of "
        f"{len(ended)} runs that failed",
        held=[near(float(np.median(ended)), 6.0)],
        some=bool(np.median(ended) > 0.0),
        why="The run goes on for 2 s after the target is lost.",
    )


@of_tracking(
    "Correction takes part in every lap: usually one or two tensions are on the threshold.",
    "figure 5.23",
    rule=f"within {SLACK:g} N of the threshold; median; never none; in part: never none",
)
def takes_part(runs: Runs) -> Finding:
    """How often correction acts."""
    check_laps(runs, CORRECTED, REFERENCE)
    mean = column(runs, CORRECTED, "at_threshold")[:, 1:]
    low, high = float(np.nanmin(mean)), float(np.nanmax(mean))
    middle = float(np.nanmedian(mean))
    least = float(np.nanmedian(np.nanmin(column(runs, CORRECTED, "tensions_n"), axis=-1)))
    return Finding(
        found=f"{middle:.1f} in the mean of a lap (median; from {low:.1f} to {high:.1f})",
        held=[USUAL[0] <= middle <= USUAL[1], low > 0.0],
        some=low > 0.0,
        why=f"The least tension at a moment is {least:.1f} N in the median: the correction winds "
        "up and never pays out, and a cable that it has tightened stays above the threshold until "
        "the winches' running off brings one down to it again.",
    )


@of_tracking(
    "With correction tensions are the same in laps 10, 30 and 700.",
    "figure 5.23",
    rule="the same: twice what laps 10 and 30 differ by, or the accuracy of the sensors; in part: "
    "four times",
)
def same_tensions(runs: Runs) -> Finding:
    """Tensions of laps 10, 30 and 700."""
    columns = [TENSION_LAPS.index(10), TENSION_LAPS.index(30), len(TENSION_LAPS)]
    tensions = column(runs, CORRECTED, "tensions_n")[:, columns]
    if not np.all(np.isfinite(tensions)):
        raise MissingRuns("laps are missing")

    def apart(one: int, other: int) -> float:
        change = tensions[:, one] - tensions[:, other]
        return float(np.sqrt(np.mean(change**2)))

    soon, late = apart(0, 1), apart(0, 2)
    return Finding(
        found=f"rms difference of lap 30 from lap 10 {soon:.2f} N, of the last lap {late:.2f} N, "
        f"at {PHASES} moments of a lap",
        held=[late <= max(2.0 * soon, SLACK)],
        some=late <= 4.0 * soon,
    )


@of_tracking(
    "With correction only the first lap's path differs, as the task begins there.",
    "figure 5.20",
    rule="twice as far; in part: farther",
)
def only_the_first(runs: Runs) -> Finding:
    """The first lap's path with correction."""
    check_laps(runs, CORRECTED, REFERENCE)
    away = column(runs, CORRECTED, "path_m")
    first, later = float(np.nanmedian(away[:, 0])), float(np.nanmedian(away[:, 1:]))
    return Finding(
        found=f"{1e3 * first:.1f} mm from lap {REFERENCE} in lap 1, {1e3 * later:.1f} mm in others "
        "(medians)",
        held=[first > 2.0 * later],
        some=first > later,
    )


@statement(
    "How long estimators 4 and 7 last is decided by what is not printed.",
    "4: 2, 7: 4",
    rule=f"with one choice both agree within a factor {FACTOR:g}; in part: one does, or it changes "
    "how long they last",
    basis=OURS,
)
def lengths_depend(runs: Runs) -> Finding:
    """How long estimators 4 and 7 last under other choices."""
    words, good = [], {}
    names = {"as chosen": "", **{name: f"{name}, " for name in VARIED}}
    for name, prefix in names.items():
        laps = {k: median_laps(runs, f"{prefix}estimator {k}") for k in VARIED_ESTIMATORS}
        label = VARIED[name][0] if name in VARIED else name
        ends = {NUMBERS[k]: runs(configuration=f"{prefix}estimator {k}") for k in laps}
        words.append(f"{label}: " + ", ".join(f"{n}: {laps_words(e)}" for n, e in ends.items()))
        good[name] = [near(laps[k], PUBLISHED_LAPS[k]) for k in laps]
    medians = {n: median_laps(runs, f"{p}estimator cable_lengths") for n, p in names.items()}
    most, least = max(medians, key=medians.__getitem__), min(medians, key=medians.__getitem__)
    helps = longer(medians[most], medians["as chosen"]) or medians[least] < medians["as chosen"]
    return Finding(
        found="; ".join(words),
        held=[any(all(pair) for pair in good.values())],
        some=any(map(any, good.values())) or helps,
        why="Estimator 4 lasts longest with "
        f"{VARIED[most][0] if most in VARIED else most}, shortest with "
        f"{VARIED[least][0] if least in VARIED else least}.",
    )


CHECKS = (
    fails_far_off, far_surpasses, spikes, spikes_by_slack, lengths_depend, worse_and_worse,
    corners, noticed_early, first_laps, underactuated, last_seconds, takes_part,
    same_tensions, only_the_first,
)  # fmt: skip
"""Judges of slack, and of what follows from it."""
