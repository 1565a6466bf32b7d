"""Case study I, where runs end: table 2.1, figure 2.14, how estimates repeat."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.studies.framework.case_definition import Configuration
from cdpr_drake.analyses.studies.framework.experiments import wrong_points
from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Run, Runs
from cdpr_drake.analyses.studies.framework.statement import (
    CHOICE,
    HARDWARE,
    Check,
    Finding,
    statement,
)
from cdpr_drake.analyses.visualization.figure_style import bar_style, new_figure
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.pose_accuracy import Repeatability, repeatability
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.palette import nth_look

LENGTHS = ("4", "5", "6", "7")

PRINTED_ENDS = {"a": (1.0, 1.7), "ap": (0.9, 1.9), "c": (1.5, None), "cp": (1.6, None)}
"""Repeatability and accuracy of the final position [mm]. Source: table 2.1."""

PRINTED_TURNS = {"a": (0.42, 0.68), "ap": (0.49, 0.59), "c": (0.17, None), "cp": (0.31, None)}
"""The same of the final rotation [deg]. Source: table 2.1."""

FACTOR = 2.0
"""A number within this factor of the printed one, below or above, counts as met."""

TO_GOAL = "one goal"
"""Group of the runs of figure 2.14: the same motion without and with a camera."""

GOAL_KEYS = ("1", "2", "3", "4", "5", "6")
"""Estimators of its runs with PBVS, five runs each, thirty in all."""

POINTS = wrong_points()
"""What the model has wrong in section 2.3.1, for both controllers."""

BLIND = "open_loop={waypoints: [{pose: {position: [0.284, -0.197, 0.08]}, duration: 10}]}"
"""Section 2.3.1, to its first goal."""

PRINTED_BETTER = (5.0, 4.0)
"""How many times better PBVS is, in position and in rotation. Source: section 2.3.6."""

CLOSE = 1.25
"""Largest and mean deviation are very close if one is at most so many times the other."""

IDEAL = (1.0, 0.1)
"""Runs repeat almost ideally, margins almost invisible, within so much [mm, deg]."""

ABOUT = (10.0, 2.0)
"""Printed repeatability of Est. 4 with a wrong first pose [mm, deg]. Source: section 2.3.3."""


def met(value: float, printed: float) -> bool:
    """Whether a value is within `FACTOR` of a printed one."""
    return printed / FACTOR <= value <= FACTOR * printed


def to_goal(estimators: Mapping[str, tuple[str, str]]) -> tuple[Configuration, ...]:
    """Configurations of figure 2.14.

    Args:
        estimators: Name in a scenario and label, by the thesis' number.
    """
    servo = tuple(
        Configuration(
            f"g_{key}",
            f"PBVS, {estimators[key][1]}",
            (*POINTS, f"estimator.kind={estimators[key][0]}"),
            group=TO_GOAL,
        )
        for key in GOAL_KEYS
    )
    blind = Configuration("g_blind", "open loop", (*POINTS, BLIND), TO_GOAL, repetitions=10)
    return (blind, *servo)


@statement(
    "Repeatability and accuracy of the final position over all estimators (table 2.1).",
    "ACROBOT 1.0 and 1.7 mm, perturbed 0.9 and 1.9 mm; CAROCA 1.5 mm, perturbed 1.6 mm",
    rule=f"Confirmed: all within a factor of {FACTOR:g}; in part: none above it",
    cause=HARDWARE,
)
def repeatable(runs: Runs) -> Finding:
    """Table 2.1: both sides count, for far better than printed is another robot, too."""
    found = {}
    for prefix in PRINTED_ENDS:
        converged, _ = _converged(runs, prefix)
        ends = [run["camera_path"][-1] for run in converged]
        goals = [run["camera_line"][-1] for run in converged]
        if not ends:
            found[prefix] = (np.inf, np.inf, 0)
            continue
        middle = np.mean(ends, axis=0)
        found[prefix] = (
            1e3 * float(np.max(np.linalg.norm(np.array(ends) - middle, axis=1))),
            1e3 * float(np.linalg.norm(middle - np.mean(goals, axis=0))),
            len(ends),
        )
    words = "; ".join(
        f"{p}: {r:.2f} and {a:.2f} mm ({n} runs)" if n else _none_of(runs, p)
        for p, (r, a, n) in found.items()
    )
    pairs = [
        (value, printed)
        for prefix, numbers in PRINTED_ENDS.items()
        for value, printed in zip(found[prefix], numbers, strict=False)
        if printed is not None
    ]
    return Finding(
        found=words,
        held=[met(*pair) for pair in pairs],
        some=all(value <= FACTOR * printed for value, printed in pairs),
        why="a: ACROBOT, c: CAROCA, p: perturbed; runs that converged, and without the estimates "
        "from images in the last, as in the thesis. Below it the simulation lacks what the "
        "prototype's ends differ by.",
    )


@statement(
    "Repeatability and accuracy of the final rotation over all estimators (table 2.1).",
    "ACROBOT 0.42 and 0.68 deg, perturbed 0.49 and 0.59 deg; CAROCA 0.17 deg, perturbed 0.31 deg",
    rule=f"As of the positions: confirmed within a factor of {FACTOR:g}, in part where none is "
    "above it",
    cause=HARDWARE,
)
def turns_repeat(runs: Runs) -> Finding:
    """Table 2.1, its rotations; both sides count, as of its positions."""
    found = {prefix: _ends(runs, prefix) for prefix in PRINTED_TURNS}
    degrees = {
        prefix: (np.inf, np.inf)
        if one is None
        else (
            float(np.degrees(one.rotation_repeatability)),
            float(np.degrees(one.rotation_accuracy)),
        )
        for prefix, one in found.items()
    }
    pairs = [
        (value, printed)
        for prefix, numbers in PRINTED_TURNS.items()
        for value, printed in zip(degrees[prefix], numbers, strict=True)
        if printed is not None
    ]
    return Finding(
        found="; ".join(
            _none_of(runs, p)
            if one is None
            else "{}: {:.3f} and {:.3f} deg ({} runs)".format(p, *degrees[p], one.count)
            for p, one in found.items()
        ),
        held=[met(*pair) for pair in pairs],
        some=all(value <= FACTOR * printed for value, printed in pairs),
        why="Below it the simulation lacks what the prototype's ends differ by: its camera is "
        "exact but for 0.1 px in the corners, and the tracker that measured has no error.",
    )


def _converged(runs: Runs, prefix: str) -> tuple[list[Run], int]:
    """Converged runs of a row of table 2.1, all estimators together, and how many there are in all.

    Raises:
        MissingRuns: One of its configurations was not run.
    """
    keys = "1234567" if prefix != "cp" else "14567"
    every = [run for key in keys for run in runs(configuration=f"{prefix}_{key}")]
    return [run for run in every if run["outcome"] == "converged"], len(every)


def _none_of(runs: Runs, prefix: str) -> str:
    """Words for a row of which no run converged: its number is none that can be met."""
    return f"{prefix}: none of {_converged(runs, prefix)[1]} runs converged"


def _ends(runs: Runs, prefix: str) -> Repeatability | None:
    """Ends of the camera in the converged runs of a row of table 2.1; None without any."""
    ends = [run["camera_ends"] for run in _converged(runs, prefix)[0]]
    if not ends:
        return None
    return repeatability([pose_from_row(end) for end, _ in ends], pose_from_row(ends[0][1]))


@statement(
    "At the same goal PBVS is five times more accurate in position and four times in "
    "orientation than open loop (figure 2.14).",
    "5 and 4 times; 10 and 30 runs",
    rule=f"Confirmed within a factor {FACTOR:g}; in part: better in both",
    cause=CHOICE,
)
def servo_pays(runs: Runs) -> Finding:
    """Figure 2.14."""
    errors = _errors_at_goal(runs)
    ratios = [
        float(np.mean(far) / np.mean(near))
        for far, near in zip(errors["open loop"], errors["PBVS"], strict=True)
    ]
    good = [met(ratio, printed) for ratio, printed in zip(ratios, PRINTED_BETTER, strict=True)]
    return Finding(
        found="; ".join(
            f"{words} {np.mean(p):.2f} mm ({np.min(p):.2f} to {np.max(p):.2f}), "
            f"{np.mean(r):.2f} deg ({np.min(r):.2f} to {np.max(r):.2f}), {len(p)} runs"
            for words, (p, r) in errors.items()
        )
        + f"; {ratios[0]:.1f} and {ratios[1]:.1f} times",
        held=good,
        some=min(ratios) > 1.0,
        why="True errors; by how much the model's points are wrong, which decides how far open "
        "loop ends away, is chosen (5 mm), and PBVS ends where its measured error stays below the "
        "threshold.",
    )


def _errors_at_goal(runs: Runs) -> dict[str, tuple[Array, Array]]:
    """True errors at the end by controller, of all its runs: positions [mm], rotations [deg]."""
    errors = {}
    names = {"open loop": ("g_blind",), "PBVS": tuple(f"g_{key}" for key in GOAL_KEYS)}
    for words, some in names.items():
        positions, rotations = (
            np.concatenate([runs(configuration=name)[metric] for name in some])
            for metric in ("position_error_m", "rotation_error_rad")
        )
        errors[words] = 1e3 * positions, np.degrees(rotations)
    return errors


def accuracy_figure(runs: Runs) -> Figure:
    """Figure 2.14: bars of the errors at the goal, means with their range."""
    errors = _errors_at_goal(runs)
    figure, panels = new_figure(
        1, 2, (11.0, 5.5), "Accuracy at the same goal, as figure 2.14; mean and range"
    )
    for axes, k, label in zip(panels, (0, 1), ("position [mm]", "rotation [deg]"), strict=True):
        for place, values in enumerate(errors.values()):
            mean, low, high = (float(f(values[k])) for f in (np.mean, np.min, np.max))
            axes.bar(
                place, mean, 0.6, yerr=[[mean - low], [high - mean]], capsize=6,
                **bar_style(nth_look(place)),
            )  # fmt: skip
            word = "run" if len(values[k]) == 1 else "runs"
            axes.text(place, high, f" {len(values[k])} {word}", ha="center", va="bottom")
        axes.set_xticks(range(len(errors)), list(errors))
        axes.set_ylabel(f"true error at the end, {label}")
        axes.margins(y=0.12)  # for the words on the whiskers
        axes.grid(visible=False, axis="x")
    return figure


@statement(
    "With a wrong initial pose mean and largest error of Est. 1, 5, 6, 7 are very close and "
    "repeat almost ideally; Est. 4 repeats within about 1 cm and 2 deg.",
    "section 2.3.3, figure 2.7b",
    rule=f"Very close: within {100.0 * (CLOSE - 1.0):g} %; almost ideally: within {IDEAL[0]:g} mm "
    f"and {IDEAL[1]:g} deg; Est. 4 within a factor {FACTOR:g}",
    cause=HARDWARE,
)
def repeats_by_estimator(runs: Runs) -> Finding:
    """Section 2.3.3, figure 2.7b."""
    means: dict[str, float] = {}
    largest: dict[str, float] = {}
    spans: dict[str, tuple[float, float]] = {}
    for key in ("1", *LENGTHS):
        some = runs(configuration=f"ap_{key}")
        far = 1e3 * some["estimate_max_m"]
        turned = np.degrees(some["estimate_max_rad"])
        means[key] = 1e3 * float(np.mean([np.mean(r["estimate_distance"]) for r in some]))
        largest[key] = float(np.mean(far))
        spans[key] = float(np.ptp(far)), float(np.ptp(turned))
        if len(some) < 2:
            raise MissingRuns("one run does not repeat")
    steady = ("1", "5", "6", "7")
    close = all(largest[key] <= CLOSE * means[key] for key in steady)
    ideal = all(spans[key][0] <= IDEAL[0] and spans[key][1] <= IDEAL[1] for key in steady)
    fourth = all(met(value, printed) for value, printed in zip(spans["4"], ABOUT, strict=True))
    return Finding(
        found="; ".join(
            f"{key}: mean {means[key]:.1f}, largest {largest[key]:.1f} mm, repeats within "
            f"{spans[key][0]:.1f} mm, {spans[key][1]:.2f} deg"
            for key in means
        ),
        held=[close, ideal, fourth],
        some=close or ideal,
        why="In simulation nothing sets Est. 4 apart from Est. 5: the seeds change the noise of "
        "the image alone.",
    )


ENDS: Sequence[Check] = (
    repeatable, turns_repeat, servo_pays, repeats_by_estimator,
)  # fmt: skip
"""Judges of where runs end."""
