"""Study: case X of the servoing thesis, slack cables on CAROCA, with and without correction."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from cdpr_drake.analyses.studies.facts import MissingRuns
from cdpr_drake.analyses.studies.servo import CAROCA_ASSUMPTION, PULLEYS, Configuration, servo_study
from cdpr_drake.analyses.studies.servo_figures import (
    DEG,
    cable_layout,
    ends_layout,
    paths_layout,
)
from cdpr_drake.analyses.studies.slack import OFF, PLAIN, experiments, slack_change, slack_numbers
from cdpr_drake.analyses.studies.study import Frame
from cdpr_drake.arrays import Array

Curves = Mapping[str, Array]

THRESHOLD = 30.0
"""Tension below which the thesis counts a cable as slack [N]."""

THRESHOLDS = (150.0, 120.0, 120.0, 80.0, 120.0, 130.0, 30.0, 10.0)
"""What the sensors read then: that, and what they read on slack cables [N]."""

CHOSEN = (2, 7)
"""Cables that are paid out at the start: those whose tensions begin just below the threshold."""

ON = f"tension_management={{kind: constant, threshold: {list(THRESHOLDS)}, gain: 0.001}}"
ALL = tuple(f"E{k}" for k in range(1, 11))


def first_time(curves: Curves, cable: int, below: bool) -> float:
    """Time at which a cable, from 0, first pulls with `THRESHOLD`, or with less [s]; infinity if it
    never does."""
    there = (curves["tensions"][:, cable] < THRESHOLD) == below
    return float(curves["time"][np.argmax(there)]) if np.any(there) else float("inf")


def c3_slack(curves: Curves) -> float:
    """How long C3 pulls with less [s]."""
    return float(np.sum(np.diff(curves["time"]) * (curves["tensions"][:-1, 2] < THRESHOLD)))


def c1_reading(curves: Curves) -> float:
    """Least reading of C1's sensor beyond its threshold [N]."""
    return float(np.min(curves["measured_tensions"][:, 0])) - THRESHOLDS[0]


def correcting_share(curves: Curves) -> float:
    """Share of the time in which some cable is corrected [-]; 0 without correction.

    It counts until the camera has gone 95 % of its way: the rest is an approach.
    """
    if "tension_corrections" not in curves:
        return 0.0
    steps = np.linalg.norm(np.diff(curves["camera_path"], axis=0), axis=1)
    going = np.cumsum(steps) < 0.95 * np.sum(steps)
    return float(np.mean(np.any(curves["tension_corrections"][1:][going] < 0.0, axis=1)))


def case_10_numbers(curves: Curves) -> dict[str, float]:
    """Columns of this study, beside those of every servo."""
    return {
        **slack_numbers(curves, THRESHOLD),
        "c7_taut_s": first_time(curves, cable=6, below=False),
        "c3_slack_s": c3_slack(curves),
        "c3_first_s": first_time(curves, cable=2, below=True),
        "c1_reading_n": c1_reading(curves),
        "correcting": correcting_share(curves),
    }


def pair(name: str, words: str, changes: tuple[str, ...], group: str) -> list[Configuration]:
    """Without and with correction."""
    return [
        Configuration(f"{name}_plain", words, (*changes, OFF), group),
        Configuration(f"{name}_corrected", f"{words}, corrected", (*changes, ON), group),
    ]


def softer(ratio: str) -> tuple[str, ...]:
    """Cables of a share of the stiffness, with the same share of critical damping as in the robot's
    file, whose retardation time is 0.3 ms."""
    damping = f"cables.retardation_time={3.0e-4 / np.sqrt(float(ratio)):.6f}"
    return (slack_change(6, CHOSEN), f"cables.stiffness_ratio={ratio}", damping)


MASSLESS = (
    slack_change(6, CHOSEN),
    "cables={model: kelvin_voigt, stiffness_ratio: 0.05, retardation_time: 0.006}",
    "damping={translation: 0, rotation: 0}",
)  # fmt: skip
"""Cables that were once fitted to E3 to E10: straight, without weight or pulleys."""

CONFIGURATIONS = (
    *experiments(CHOSEN, ON),
    *(
        c
        for name, cables in {"cables_1_2": (1, 2), "cables_7": (7,), "cables_7_8": (7, 8)}.items()
        for c in pair(
            name,
            f"slack on cables {', '.join(map(str, cables))}",
            (slack_change(6, cables),),
            "cables",
        )
    ),
    *(
        c
        for ratio in ("0.02", "0.1")
        for c in pair(f"stiffness_{ratio}", f"stiffness x {ratio}", softer(ratio), "stiffness")
    ),
    *pair("massless", "massless, stiffness x 0.05", MASSLESS, "stiffness"),
    *(
        Configuration(
            f"accuracy_{n}_corrected",
            f"sensors off by up to {n} N, corrected",
            (slack_change(6, CHOSEN), ON, f"sensors.tension_accuracy={n}"),
            "sensors",
        )
        for n in ("25", "75")
    ),
)


def first_moment(rows: Frame) -> tuple[list[bool], str]:
    """What slack does before the servo starts: readings of C2 and C7 are below their thresholds by
    less than the sensors' accuracy, and the first image of the tag moves."""
    rows = rows[rows["camera"] == "projected"]

    def first(name: str, curve: str) -> Array:
        some = rows[rows["configuration"] == name]
        if not len(some):
            raise MissingRuns(name)
        return np.mean([arrays[curve][0] for arrays in some["arrays"]], axis=0)

    below, moved = {}, {}
    for name in PLAIN[1:]:
        readings = first(name, "measured_tensions")
        below[name] = [float(THRESHOLDS[k] - readings[k]) for k in (1, 6)]
        moved[name] = float(np.linalg.norm(first(name, "image_path") - first("E1", "image_path")))
    words = ", ".join(
        f"{n} {a:.0f}, {b:.0f} N below, {moved[n]:.1f} px" for n, (a, b) in below.items()
    )
    just = all(0.0 < value < 75.0 for values in below.values() for value in values)
    return [just, all(value > 0.0 for value in moved.values())], words


def choices(rows: Frame) -> Frame:
    """What is not printed and was chosen: which cables are slack, how they are modelled, how wrong
    the sensors are; 6 cm, without and with correction."""
    found = []
    groups = rows.groupby("configuration", sort=False)
    for name, mine in groups:
        if name in ("E7", "E8") or name not in ALL:
            found.append({
                "configuration": name, "image [px]": mine["image_max_px"].mean(),
                "camera [mm]": 1e3 * mine["camera_max_m"].mean(),
                "estimate [deg]": DEG * mine["estimate_max_rad"].mean(),
                "lost": int((mine["outcome"] == "target_lost").sum()), "of": len(mine),
            })  # fmt: skip
    return Frame(found)


STUDY = servo_study(
    name="case-10",
    title="Slack cables on CAROCA, with and without tension correction",
    source="servoing thesis 5.3.2, figures 5.24 to 5.26",
    scenario="caroca_slack_start",
    configurations=CONFIGURATIONS,
    changes=(
        PULLEYS,
        "perturbations.initial_pose_shift={distance: 0.02, angle_deg: 1.5}",
        "perturbations.exit_points=0.005",
        "perturbations.anchor_points=0.002",
        "sensors.log=[tension]",
        "integration.engine=compiled",
    ),
    rendered=("E8",),
    repetitions=10,
    stability=THRESHOLD,
    metrics=case_10_numbers,
    columns=(
        "time_to_taut_s", "estimate_end_m", "estimate_end_rad", "winch_work_j", "chatter_n",
        "correction_m", "c7_taut_s", "c3_slack_s", "c3_first_s", "c1_reading_n", "correcting",
    ),
    assumptions=(
        "Which cables are paid out is not printed: C2 and C7, whose tensions begin just below the "
        "threshold; C1 and C2, C7 alone, C7 and C8 are run beside them.",
        "The platform hangs at rest with the slack when the servo starts: it is printed that it "
        "turns a little when slack is added, and that the first image shows that.",
        CAROCA_ASSUMPTION,
        "Stiffness of the cables as mounted is not printed: two smaller ones are run beside it, "
        "and massless cables that were fitted once, with three runs each of E3, E4, E7, E8, E9 and "
        "E10 in sight.",
        "The readings of slack cables hold the constant errors of the sensors, as they were taken "
        "on this robot; what they do not hold, at other poses, is 0 here, and 25 and 75 N beside.",
        "The printed poses of the tag in the camera at start and goal put it 0.12 m and 0.10 m "
        "below the ground, 25 mm apart and turned by 208 deg. Here it lies on the ground, where "
        "the first one puts it, and the goal is the printed desired pose of the platform.",
        "What controller and estimator believe wrongly is not printed: the first pose by 20 mm and "
        "1.5 deg, exit points by 5 mm, anchor points by 2 mm, in directions drawn for each seed.",
        "The robot is moved by the compiled engine, see `cdpr study engines`.",
    ),
    finds={"first_moment": first_moment},
    tables={"What was chosen": choices},
    figures={
        "figure_5_24": paths_layout("Figure 5.24: 2 1/2 D on CAROCA with slack cables", ALL),
        "figure_5_25": partial(cable_layout, "Figure 5.25: cable tensions", "cable_tensions", ALL),
        "figure_5_26": ends_layout("5.26", ALL),
    },
)  # fmt: skip
