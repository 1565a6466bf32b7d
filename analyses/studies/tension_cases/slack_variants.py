"""Every way to manage tensions on the same runs with slack cables, and which one to take."""

from __future__ import annotations

import numpy as np
from rich.table import Table

from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.framework.case_definition import Configuration
from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Runs
from cdpr_drake.analyses.studies.framework.statement import SOURCE, Finding, statement
from cdpr_drake.analyses.studies.tension_cases.slack_experiments import slack_change, there
from cdpr_drake.arrays import Array

VARIANTS: dict[str, tuple[str, str]] = {
    "fast": ("the same at 500 Hz", "{gain: 0.04, rate: 500}"),
    "adaptive": ("gain by surplus length", "{kind: adaptive, gain_per_length: 2}"),
    "by_length": (
        "threshold by length, linear, 1 to 3 N",
        "{kind: by_length, gain: 0.04, highest: [3], shortest: 0.6, longest: 1.4}",
    ),
    "by_length_exponential": (
        "threshold by length, exponential, 1 to 3 N",
        "{kind: by_length, gain: 0.04, highest: [3], shortest: 0.6, longest: 1.4, "
        "shape: exponential}",
    ),
    "distribution_p": ("tension distribution, P", "{kind: distribution, proportional: 0.003}"),
    "distribution_pi": (
        "tension distribution, PI",
        "{kind: distribution, proportional: 0.003, integral: 0.003}",
    ),
    "distribution_pid": (
        "tension distribution, PID",
        "{kind: distribution, proportional: 0.003, integral: 0.003, derivative: 0.00002}",
    ),
    "length": ("the two cables of least tension, by length", "{kind: length}"),
    "image": (
        "constant, faster by the slack a camera sees",
        "{kind: image, gain: 0.04, allowance: 0.002}",
    ),
    "polygon": ("inside the feasible polygon by 1 N", "{kind: polygon, gain: 0.04, rate: 500}"),
}
"""Ways to manage tensions that are compared with 4 cm of slack: words and section. A constant
threshold and gain at 25 Hz is E6. Gains are chosen, as the thesis tried none of these; following a
distribution with three times the gain, or five times the derivative, is unstable."""

TORQUE = "torque_control={rate: 1000, method: barycenter, limits: [1, 60]}"
PLATFORM_TAG = (
    "estimator={kind: eye_to_hand, platform_tag: {tag_id: 5, size: 0.12, "
    "pose: {position: [0, -0.1, 0.06], angles_deg: [55, 0, 0]}}}"
)
BY_TORQUE: dict[str, tuple[str, tuple[str, ...]]] = {
    "servo": ("servoed by torque", (TORQUE,)),
    "second_camera": ("by torque, a second camera tells the pose", (TORQUE, PLATFORM_TAG)),
    "planned": ("by torque to a planned pose", (TORQUE, "pose_plan={}")),
}
"""The ways of 5.2.3 and 5.2.4, which wind slack up without a correction beside the servo: words and
changes of `acrobot_torque_servo`, which is `acrobot_slack_start` but for motors and their control.
The tag on the platform and where its camera stands are chosen."""

COMPARED: dict[str, str] = {
    "E5": "none",
    "E6": "constant threshold and gain, 25 Hz",
    **{f"variant_{name}": words for name, (words, _) in VARIANTS.items()},
    **{f"torque_{name}": words for name, (words, _) in BY_TORQUE.items()},
}
"""What is compared, by the names of configurations."""

COLUMNS = {
    "time_to_taut_s": ("slack gone, latest [s]", 1.0, ".2f"),
    "estimate_max_m": ("estimate, largest [mm]", 1e3, ".0f"),
    "image_max_px": ("image, largest [px]", 1.0, ".0f"),
    "cable_power_w": ("cable power [W]", 1.0, ".2f"),
    "chatter_n": ("chatter [N]", 1.0, ".2f"),
    "underactuated_s": ("underactuated [s]", 1.0, ".2f"),
    "least_margin_taut": ("least margin", 1.0, ".2f"),
}
"""What tells the ways apart: heading, factor to its unit, format. Of times, estimates and path the
worst run counts, of margins the least, of power and chatter the mean."""

WORST = ("time_to_taut_s", "estimate_max_m", "image_max_px", "underactuated_s")

SOON, RIGHT = 2.0, 0.06
"""Slack should be gone within this time [s], and no estimate be further off than this [m]."""


def variants(cables: tuple[int, ...]) -> tuple[Configuration, ...]:
    """Runs with 4 cm of slack on some cables, by each way but E6."""
    return tuple(
        Configuration(
            f"variant_{name}",
            words,
            (slack_change(4, cables), f"tension_management={section}"),
            "variants",
        )
        for name, (words, section) in VARIANTS.items()
    )


def by_torque(cables: tuple[int, ...]) -> tuple[Configuration, ...]:
    """Runs with 4 cm of slack on some cables, by motor torques."""
    return tuple(
        Configuration(
            f"torque_{name}", words, (slack_change(4, cables), *changes), "by torque",
            "acrobot_torque_servo",
        )
        for name, (words, changes) in BY_TORQUE.items()
    )  # fmt: skip


def compared(runs: Runs) -> dict[str, dict[str, float]]:
    """The numbers of `COLUMNS` by configuration, in SI units.

    Raises:
        MissingRuns: No way was run.
    """
    found = {}
    for name in there(runs, [name for name in COMPARED if name != "E5"]) and there(
        runs, list(COMPARED)
    ):
        found[name] = {metric: _one(metric, runs(configuration=name)[metric]) for metric in COLUMNS}
    return found


def _one(metric: str, values: Array) -> float:
    if metric in WORST:
        return float(np.max(values))
    return float(np.min(values) if metric == "least_margin_taut" else np.mean(values))


def usable(numbers: dict[str, float]) -> bool:
    """Whether a way takes up slack soon and does not harm, in every run."""
    return (
        numbers["time_to_taut_s"] < SOON
        and numbers["estimate_max_m"] < RIGHT
        and numbers["least_margin_taut"] > 0.0
    )


def which_to_take(runs: Runs) -> Table:
    """Every way beside the others; the best number of each column among usable ones has a star."""
    found = compared(runs)
    good = {name: numbers for name, numbers in found.items() if usable(numbers)}
    table = new_table(
        "Which way to take up 4 cm of slack", ("way", "usable"), [c[0] for c in COLUMNS.values()]
    )
    for name, numbers in found.items():
        cells = []
        for metric, (_, factor, form) in COLUMNS.items():
            others = [other[metric] for other in good.values()]
            best = (max if metric == "least_margin_taut" else min)(others, default=np.nan)
            star = "*" if name in good and numbers[metric] == best else ""
            cells.append(format(factor * numbers[metric], form) + star)
        table.add_row(COMPARED[name], "yes" if name in good else "no", *cells)
    table.caption = (
        f"Usable: every run has its slack gone within {SOON:g} s, an estimate within "
        f"{1e3 * RIGHT:g} mm and a positive margin from then on. Times, estimates and path: the "
        "worst run; margin: the least; power and chatter: the mean. *: the best usable one."
    )
    return table


@statement(
    "More complex methods were not implemented, as the simple one gives very good results.",
    "section 5.3",
    cause=SOURCE,
)
def advice(runs: Runs) -> Finding:
    """Whether the simplest way is enough."""
    found = compared(runs)
    if "E6" not in found:
        raise MissingRuns("configuration E6")
    good = [name for name, numbers in found.items() if usable(numbers)]
    simple = found["E6"]
    better = {
        name: [m for m in COLUMNS if m != "least_margin_taut" and found[name][m] < 0.8 * simple[m]]
        for name in good
        if name != "E6"
    }
    clearly = [
        f"{COMPARED[name]} ({', '.join(COLUMNS[m][0] for m in metrics)})"
        for name, metrics in better.items()
        if metrics
    ]
    return Finding(
        found=f"usable: {', '.join(COMPARED[name] for name in good) or 'none'}",
        held=["E6" in good, not clearly],
        some="E6" in good,
        why="Here all were run, see the table. By more than a fifth better than the simple one in "
        f"something: {'; '.join(clearly) or 'none'}.",
    )
