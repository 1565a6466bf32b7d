"""What the servoing thesis states of case study X, judged by runs."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from cdpr_drake.analyses.studies.framework.case_run import OwnMetric
from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Runs
from cdpr_drake.analyses.studies.framework.statement import (
    CHOICE,
    CONSTRUCTION,
    SOURCE,
    Check,
    Finding,
    statement,
)
from cdpr_drake.analyses.studies.tension_cases.slack_experiments import (
    CORRECTED,
    FACTOR,
    PLAIN,
    listed,
    means,
    near,
    several,
    there,
)
from cdpr_drake.arrays import Array

THRESHOLD = 30.0
"""Tension below which the thesis counts a cable as slack [N]."""

THRESHOLDS = (150.0, 120.0, 120.0, 80.0, 120.0, 130.0, 30.0, 10.0)
"""What the sensors read then: that, and what they read on slack cables [N]."""

FAILED = "target_lost"

PUBLISHED_PATHS = {"E7": (80.0, 100.0), "E8": (35.0, 20.0), "E10": (90.0, 40.0)}
"""Largest deviation in the image [px] and of the camera [mm], figure 5.24."""

MOST = 0.95
"""Share of the camera's way after which the rest of a run is an approach."""

SAME_PX, SAME_MM = 15.0, 15.0
"""Deviations that differ by less are almost the same; runs without slack deviate by so much."""


def c7_taut(traces: dict[str, Array]) -> float:
    """Time at which C7 first pulls with `THRESHOLD` [s]; infinity if it never does."""
    pulls = traces["tensions"][:, 6] >= THRESHOLD
    return float(traces["time"][np.argmax(pulls)]) if np.any(pulls) else float("inf")


def c3_slack(traces: dict[str, Array]) -> float:
    """How long C3 pulls with less [s]."""
    below = traces["tensions"][:-1, 2] < THRESHOLD
    return float(np.sum(np.diff(traces["time"]) * below))


def c3_first(traces: dict[str, Array]) -> float:
    """Time at which C3 falls below `THRESHOLD` [s]; infinity if it does not."""
    below = traces["tensions"][:, 2] < THRESHOLD
    return float(traces["time"][np.argmax(below)]) if np.any(below) else float("inf")


def c1_reading(traces: dict[str, Array]) -> float:
    """Least reading of C1's sensor beyond its threshold [N]."""
    return float(np.min(traces["measured_tensions"][:, 0])) - THRESHOLDS[0]


def correcting_share(traces: dict[str, Array]) -> float:
    """Share of the time in which some cable is corrected, until the camera has gone `MOST` of its
    way [-]; 0 without correction."""
    if "tension_corrections" not in traces:
        return 0.0
    steps = np.linalg.norm(np.diff(traces["camera_path"], axis=0), axis=1)
    going = np.cumsum(steps) < MOST * np.sum(steps)
    return float(np.mean(np.any(traces["tension_corrections"][1:][going] < 0.0, axis=1)))


METRICS = {
    "c7_taut_s": OwnMetric("C7 taut from [s]", 1.0, ".1f", c7_taut),
    "c3_slack_s": OwnMetric("C3 slack [s]", 1.0, ".1f", c3_slack),
    "c3_first_s": OwnMetric("C3 slack from [s]", 1.0, ".1f", c3_first),
    "c1_reading_n": OwnMetric("C1 over threshold [N]", 1.0, ".0f", c1_reading),
    "correcting": OwnMetric("correcting [-]", 1.0, ".2f", correcting_share),
}
"""What is reported of this study's cables."""


def failures(runs: Runs, name: str) -> int:
    """Runs of a configuration that lost their target."""
    return sum(run["outcome"] == FAILED for run in runs(configuration=name))


@statement(
    "Without slack the paths with and without correction are almost the same.",
    "figure 5.24",
    rule=f"The same within {SAME_PX:g} px and {SAME_MM:g} mm.",
    cause=SOURCE,
)
def no_slack(runs: Runs) -> Finding:
    """Whether the correction leaves runs without slack alone."""
    found = {
        metric: [runs.mean(metric, configuration=name) for name in ("E1", "E2")]
        for metric in ("image_max_px", "camera_max_m")
    }
    (u, v), (a, b) = found["image_max_px"], found["camera_max_m"]
    same = abs(u - v) < SAME_PX, 1e3 * abs(a - b) < SAME_MM
    return Finding(
        found=f"E1 {u:.0f} px, {1e3 * a:.0f} mm; E2 {v:.0f} px, {1e3 * b:.0f} mm", held=same
    )


@statement(
    "Without correction the paths in the image and of the camera deviate the more the more "
    "slack there is.",
    "figure 5.24",
    cause=SOURCE,
)
def growing(runs: Runs) -> Finding:
    """Whether more slack means a longer way without correction."""
    image, camera = (several(runs, PLAIN, m) for m in ("image_max_px", "camera_max_m"))
    grows = [all(b > a for a, b in pairwise(found.values())) for found in (image, camera)]
    return Finding(found=f"{listed(image, 'px')}; {listed(camera, 'mm', factor=1e3)}", held=grows)


@statement(
    "With 6 cm the paths deviate by 80 px and 100 mm without correction, by 35 px and 20 mm "
    "with it; with 8 cm and correction by 90 px and 40 mm.",
    "figure 5.24",
    rule=f"Agreeing within a factor {FACTOR:g}",
    cause=SOURCE,
)
def paths(runs: Runs) -> Finding:
    """How far paths deviate with 6 and 8 cm."""
    words, good = [], []
    for name in there(runs, list(PUBLISHED_PATHS)):
        printed = PUBLISHED_PATHS[name]
        found = (
            runs.mean("image_max_px", configuration=name),
            1e3 * runs.mean("camera_max_m", configuration=name),
        )
        words.append(f"{name} {found[0]:.0f} px, {found[1]:.0f} mm")
        good += [near(one, other) for one, other in zip(found, printed, strict=True)]
    better = (
        runs.has(configuration="E7")
        and runs.has(configuration="E8")
        and all(
            runs.mean(metric, configuration="E8") < runs.mean(metric, configuration="E7")
            for metric in ("image_max_px", "camera_max_m")
        )
    )
    return Finding(
        found="; ".join(words),
        held=good,
        some=better or any(good),
        why="In pixels of an image 1600 px wide. Stiffness of the cables and what the controller "
        "believes wrongly are not printed, see the other stiffnesses: stiffer cables are "
        "corrected the sooner, and fail with less slack.",
    )


@statement(
    "The task fails with 8 cm without correction, and in no other experiment.",
    "section 5.3.2, figure 5.24",
    cause=CHOICE,
)
def fails(runs: Runs) -> Finding:
    """Which runs lose their target."""
    names = there(runs, [*PLAIN[1:], *CORRECTED])
    lost = {name: failures(runs, name) for name in names}
    alone = all(n == 0 for name, n in lost.items() if name != "E9")
    every = "E9" in lost and lost["E9"] == len(runs(configuration="E9"))
    return Finding(
        found=", ".join(
            f"{name} {n}/{len(runs(configuration=name))} lost" for name, n in lost.items()
        ),
        held=[alone, every],
        why="How much cables give, and what is believed wrongly, is not printed, and decides from "
        "which slack on the target is lost; massless cables of a twentieth of the stiffness, once "
        "fitted to this, keep it with 6 cm, see the other stiffnesses. The printed exception from "
        "the good trajectories, E10, must mean E9: E10 is corrected, and its path is printed to "
        "the end.",
    )


@statement(
    "C7 is slack for about 10 s without correction, for less than 2 s with it.",
    "section 5.3.2, figure 5.25",
    rule=f"Until it pulls with {THRESHOLD:g} N for the first time; about 10 s: within a factor "
    f"{FACTOR:g}",
    cause=CHOICE,
)
def c7(runs: Runs) -> Finding:
    """How long C7 is slack."""
    without = means(runs, PLAIN[1:], "c7_taut_s")
    with_it = means(runs, CORRECTED[1:], "c7_taut_s")
    long = [near(time, 10.0) for time in without.values()]
    short = [time < 2.0 for time in with_it.values()]
    return Finding(
        found=f"{listed(without, 's', 1)}; {listed(with_it, 's', 1)}",
        held=[all(long), all(short)],
        some=any(long) and any(short),
        why="The printed gain winds a slack cable in by 30 mm/s at most, which takes 2.7 s for "
        "8 cm, and by less the nearer a sagging cable comes to its threshold.",
    )


@statement(
    "At about 4 s C3 reaches its threshold; without correction its tension falls below and "
    "stays there, with correction it stays on the threshold.",
    "section 5.3.2, figure 5.25",
    rule=f"About 4 s: within a factor {FACTOR:g}; on the threshold: below it for less than half "
    "of the shortest time without",
    cause=SOURCE,
)
def c3(runs: Runs) -> Finding:
    """What C3 does after some seconds."""
    begins = means(runs, PLAIN[1:], "c3_first_s")
    without = means(runs, PLAIN[1:], "c3_slack_s")
    with_it = means(runs, CORRECTED[1:], "c3_slack_s")
    times = [near(time, 4.0) for time in begins.values()]
    kept = max(with_it.values()) < 0.5 * min(without.values())
    return Finding(
        found=f"slack from {listed(begins, 's', 1)}; for {listed(without, 's', 1)}; with "
        f"correction {listed(with_it, 's', 1)}",
        held=[all(times), kept],
        some=any(times) or kept,
        why="Runs that lose the target end before the others.",
    )


@statement(
    "The reading of C1 never reaches its threshold.", "section 5.3.2, figure 5.25", cause=SOURCE
)
def c1(runs: Runs) -> Finding:
    """Whether C1 is ever corrected."""
    least = means(runs, [*PLAIN, *CORRECTED], "c1_reading_n")
    never = [reading > 0.0 for reading in least.values()]
    return Finding(found=f"least reading beyond the threshold: {listed(least, 'N')}", held=never)


@statement(
    "Without correction the rotation of the pose estimate is the worse the more slack there "
    "is, over 20 deg at the failure of E9, where the position is off by 50 mm; with "
    "correction it is better.",
    "figure 5.26",
    cause=SOURCE,
)
def estimate(runs: Runs) -> Finding:
    """How wrong the pose estimate ends."""
    at_end = [
        {
            name: tuple(
                runs.mean(metric, configuration=name)
                for metric in ("estimate_end_m", "estimate_end_rad")
            )
            for name in there(runs, names)
        }
        for names in (CORRECTED, PLAIN)
    ]
    with_it, without = at_end
    angles = [angle for _, angle in without.values()]
    turns_more = all(b > a for a, b in pairwise(angles)) and len(angles) > 1
    less = all(
        with_it[other][1] < without[name][1]
        for name, other in zip(PLAIN[1:], CORRECTED[1:], strict=True)
        if name in without and other in with_it
    )
    last = without.get("E9")
    printed = last is not None and near(1e3 * last[0], 50.0) and np.degrees(last[1]) > 20.0
    words = [
        ", ".join(f"{name} {1e3 * d:.0f} mm, {np.degrees(a):.1f} deg" for name, (d, a) in f.items())
        for f in at_end
    ]
    return Finding(
        found=f"with {words[0]}; without {words[1]}",
        held=[turns_more, less, bool(printed)],
        some=turns_more or less,
        why="Of runs that lose the target at that moment, of others at the end, which is later. "
        "What the first estimate is off by is a chosen perturbation, see the assumptions.",
    )


@statement("Correction is needed during most of the trajectory.", "section 5.3.2", cause=SOURCE)
def needed(runs: Runs) -> Finding:
    """How much of a run is corrected."""
    shares = means(runs, CORRECTED[1:], "correcting")
    return Finding(
        found=f"some cable is corrected: {listed(shares, '%', factor=100.0)} of the time",
        held=[v > 0.5 for v in shares.values()],
    )


def chosen(name: str, pairs: Sequence[str], words: str, printed: str) -> Check:
    """Judge of what is not printed and was chosen: runs without and with correction beside others.

    Args:
        name: Of the judge, once in the study.
        pairs: Beginnings of names of configurations, to which `_plain` and `_corrected` are added,
            or a pair such as `E7/E8`.
        words: What was chosen.
        printed: What the thesis says of it.
    """

    @statement(f"{words} Without | with correction, 6 cm.", printed, name=name, basis=CONSTRUCTION)
    def judge(runs: Runs) -> Finding:
        found, better = [], []
        for pair in pairs:
            named = pair if "/" in pair else f"{pair}_plain/{pair}_corrected"
            one, other = named.split("/")
            if not (runs.has(configuration=one) and runs.has(configuration=other)):
                continue
            numbers = [_path_words(runs, name) for name in (one, other)]
            label = other.removesuffix("_corrected")
            found.append(f"{label}: {numbers[0]} | {numbers[1]}")
            better.append(
                runs.mean("estimate_max_rad", configuration=other)
                < runs.mean("estimate_max_rad", configuration=one)
                and failures(runs, other) <= failures(runs, one)
            )
        if len(found) < 2:
            raise MissingRuns("nothing to compare")
        return Finding(
            found="; ".join(found),
            held=[],
            why=f"Nothing to confirm. In {sum(better)} of {len(better)} the correction makes the "
            "estimate's rotation better and loses no more targets.",
        )

    return judge


def _path_words(runs: Runs, name: str) -> str:
    lost = failures(runs, name)
    return (
        f"{runs.mean('image_max_px', configuration=name):.0f} px, "
        f"{1e3 * runs.mean('camera_max_m', configuration=name):.0f} mm"
        f", estimate {np.degrees(runs.mean('estimate_max_rad', configuration=name)):.0f} deg"
        + (f", {lost} lost" if lost else "")
    )


STATEMENTS: Sequence[Check] = (
    no_slack, growing, paths, fails, c7, c3, c1, estimate, needed,
)  # fmt: skip
"""What is judged of E1 to E10."""
