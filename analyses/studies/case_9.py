"""Study: case IX of the servoing thesis, slack cables on ACROBOT, with and without correction."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from typing import Any

import numpy as np
from scipy.linalg import null_space
from scipy.optimize import lsq_linear
from scipy.signal import find_peaks

from cdpr_drake.analyses.studies.case_9_figures import FIGURES
from cdpr_drake.analyses.studies.experiments import wrong_points
from cdpr_drake.analyses.studies.facts import MissingRuns
from cdpr_drake.analyses.studies.servo import Configuration, projected, servo_study
from cdpr_drake.analyses.studies.slack import (
    OFF,
    TENSIONS,
    THRESHOLD,
    experiments,
    holding_problem,
    mean_tensions,
    slack_change,
    slack_numbers,
)
from cdpr_drake.analyses.studies.study import Frame
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.tensions.methods import distribute, solution_space
from cdpr_drake.tensions.problem import TensionProblem

Curves = Mapping[str, Array]

SLACK_CABLES = (1, 2)
"""Cables that are paid out at the start."""

ON = "tension_management={kind: constant, threshold: [1.0], gain: 0.04}"

CENTERS_MM = (10, 35)
"""Heights of the centre of mass above Po that are run beside that of the robot's file [mm]: of
least squares over table 5.1, and of the middle of the box."""

SOFTNESS = ("0.003", "0.03", "0.1")
"""Stiffness of the cables as mounted, of that by the modulus of their fibre, beside the 0.01 of E5
and E6."""

SENSOR, ACCURACY = 0.24, 0.3
"""Accuracy of the tension sensors, table A.6, and by which figure 5.15 varies readings [N]."""

ETAS = {
    1: (0.27, 0.32), 2: (-0.69, 0.07), 3: (7.77, 3.92), 4: (1.14, 1.44), 5: (7.75, 3.61),
    6: (1.62, 1.82), 7: (7.83, 3.81), 8: (2.92, 2.68), 9: (8.11, 3.47), 10: (3.11, 1.88),
}  # fmt: skip
"""Coordinates eta of these tensions in the null space of W, table 5.1 [N]."""

FINAL_POSE = pose_from_angles(np.array([-0.11, -0.20, 0.366]), np.radians([13.0, -20.0, 33.0]))
"""Desired pose of the platform as it was measured, section 5.3.1 [m, rad]."""

ROUNDING = 0.05 * np.sqrt(8.0) + 0.005 * np.sqrt(2.0)
"""Largest change of |N't| - |eta| by the printed digits of eight tensions and two etas [N]."""

IN_SIGHT = ("E1", "E2", "E5", "E6", "E9", "E10")
"""Experiments that were in sight when stiffness and damping were chosen."""

LATE = 25
"""Rows at the end of a run of which tensions and lengths are averaged."""

PEAK = 0.3
"""Share of the largest deviation that a spike rises above what is on either side of it."""


# Numbers of a run.


def end_tensions(curves: Curves) -> Array:
    """Measured tensions at the end of a run, shape (m,) [N]."""
    return np.asarray(np.mean(curves["measured_tensions"][-LATE:], axis=0))


def by_cable(values: Array) -> dict[str, float]:
    """Numbers of cables C1, C2, ..."""
    return {f"C{k + 1}": float(value) for k, value in enumerate(values)}


def residual_range(problem: TensionProblem, tensions: Array, accuracy: float) -> Array:
    """Residual of tensions, and the least and the largest of all within an accuracy of them.

    The residual is the distance |t_pv + N eta - t| from the plane of the solutions. The least is a
    convex program over the box t +- accuracy; the largest is at one of its corners.

    Args:
        problem: At the pose.
        tensions: As measured, shape (m,) [N].
        accuracy: Half the box's edge [N].

    Returns:
        Shape (3,) [N].

    Source: servoing thesis (1.27), figure 5.15.
    """
    particular, N = solution_space(problem)
    off_plane = np.eye(len(tensions)) - N @ N.T
    residual = off_plane @ (tensions - particular)
    box = lsq_linear(off_plane, -residual, (-accuracy, accuracy))
    corners = accuracy * np.array(list(product((-1.0, 1.0), repeat=len(tensions))))
    most = np.max(np.linalg.norm(residual + corners @ off_plane, axis=1))
    return np.array([np.linalg.norm(residual), np.sqrt(2.0 * box.cost), most])


def polygon_numbers(row: Array, tensions: Array) -> dict[str, Any]:
    """Where tensions lie beside the feasible polygon at a pose.

    eta are the coordinates along the orthonormal null space N of W from the particular solution
    t_pv.

    Returns:
        inside: True if t_pv + N eta is above the threshold, and so are the tensions within the
        sensors' accuracy; residual_n, residual_least_n, residual_most_n, see `residual_range`;
        from_barycenter_n: distance in eta from the barycenter.

    Source: servoing thesis (1.27), table 5.1.
    """
    problem = holding_problem(row)
    particular, N = solution_space(problem)
    eta = N.T @ (tensions - particular)
    on_plane = particular + N @ eta
    above = np.all(on_plane >= THRESHOLD - 1e-9) and np.all(tensions >= THRESHOLD - SENSOR)
    middle = N.T @ (distribute(problem, "barycenter").tensions - particular)
    residual, least, most = residual_range(problem, tensions, ACCURACY)
    return {
        "inside": bool(above), "residual_n": float(residual), "residual_least_n": float(least),
        "residual_most_n": float(most), "from_barycenter_n": float(np.linalg.norm(eta - middle)),
    }  # fmt: skip


def spikes(curves: Curves) -> int:
    """How many spikes the deviation in the image has."""
    deviation = curves["image_deviation"]
    seen = deviation[np.isfinite(deviation)]
    return len(find_peaks(seen, prominence=PEAK * np.max(seen))[0]) if len(seen) else 0


def middle_slack(curves: Curves) -> Array:
    """Numbers of slack cables in all but the first and the last tenth of a run."""
    slack = 8 - curves["taut_cables"]
    return np.asarray(slack[len(slack) // 10 : -len(slack) // 10])


def moments(curves: Curves) -> dict[str, int]:
    """Moments with fewer than six independent cables, and those of them without the criterion."""
    under = curves["jacobian_rank"] < 6
    failing = curves["stability_margin"][under] <= 0.0
    return {"underactuated": int(np.sum(under)), "failing": int(np.sum(failing))}


def case_9_numbers(curves: Curves) -> dict[str, Any]:
    """Columns of this study, beside those of every servo."""
    slack, tensions = middle_slack(curves), end_tensions(curves)
    return {
        **slack_numbers(curves, THRESHOLD),
        "end_tension_n": by_cable(tensions),
        "end_length_m": by_cable(np.mean(curves["unstrained_lengths"][-LATE:], axis=0)),
        "polygon": polygon_numbers(curves["X_WP"][-1], tensions),
        "spikes": spikes(curves),
        "three_slack_share": float(np.mean(slack >= 3)),
        "most_slack": int(np.max(slack)),
        "least_margin": float(np.min(curves["stability_margin"])),
        "moments": moments(curves),
    }


# What is run.

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

COMPARED = {
    "E5": "none", "E6": "constant threshold and gain, 25 Hz",
    **{f"variant_{name}": words for name, (words, _) in VARIANTS.items()},
    **{f"torque_{name}": words for name, (words, _) in BY_TORQUE.items()},
}  # fmt: skip
"""What is compared, by the names of configurations."""


def softer(ratio: str, corrected: bool) -> Configuration:
    """Cables of another stiffness, of the same share of critical damping."""
    damping = 0.0002 / np.sqrt(float(ratio))
    cables = f"cables={{stiffness_ratio: {ratio}, retardation_time: {damping:.6f}}}"
    return Configuration(
        f"stiffness_{ratio}_{'corrected' if corrected else 'plain'}",
        f"stiffness x {ratio}" + (", corrected" if corrected else ""),
        (slack_change(4, SLACK_CABLES), ON if corrected else OFF, cables),
        "stiffness",
    )


def configurations() -> tuple[Configuration, ...]:
    """E1 to E10; other ways to take up slack, by torque too; other centres of mass, stiffnesses."""
    four = slack_change(4, SLACK_CABLES)
    variants = [
        Configuration(f"variant_{name}", words, (four, f"tension_management={section}"), "variants")
        for name, (words, section) in VARIANTS.items()
    ]
    torques = [
        Configuration(
            f"torque_{name}", words, (four, *changes), "by torque", "acrobot_torque_servo"
        )
        for name, (words, changes) in BY_TORQUE.items()
    ]
    centers = [
        Configuration(
            f"center_{height}_{name}",
            f"{name}, centre of mass at {height} mm",
            (slack_change(2, SLACK_CABLES), change),
            "centre of mass",
            platform={"center_of_mass": (0.0, 0.0, 1e-3 * height)},
        )
        for height in CENTERS_MM
        for name, change in (("E3", OFF), ("E4", ON))
    ]
    stiffnesses = [softer(ratio, corrected) for ratio in SOFTNESS for corrected in (False, True)]
    return (*experiments(SLACK_CABLES, ON), *variants, *torques, *centers, *stiffnesses)


# What facts ask of several runs.


def distances_from_table(rows: Frame) -> tuple[list[bool], str]:
    """Mean distances of the tensions at the end from table 5.1, of what nothing was fitted on."""
    rows = projected(rows)
    off = {
        f"E{number}": float(np.mean(np.abs(mean_tensions(rows, f"E{number}") - printed)))
        for number, printed in TENSIONS.items()
    }
    blind = float(np.mean([value for name, value in off.items() if name not in IN_SIGHT]))
    moved = {
        f"{name} with the centre of mass at {height} mm": float(
            np.mean(np.abs(mean_tensions(rows, f"center_{height}_{name}") - TENSIONS[number]))
        )
        for height in CENTERS_MM
        for number, name in ((3, "E3"), (4, "E4"))
        if (rows["configuration"] == f"center_{height}_{name}").any()
    }
    words = ", ".join(f"{name} {value:.2f}" for name, value in {**off, **moved}.items())
    mean = np.mean(list(off.values()))
    return [blind < 1.0], f"of E3, E4, E7, E8 {blind:.2f} N, of all {mean:.2f} N: {words} N"


def norms_of_etas(rows: Frame) -> tuple[list[bool], str]:
    """Arithmetic alone: |N't| of the printed tensions at the printed pose beside |eta|."""
    J = cable_jacobian(FINAL_POSE, load_robot("acrobot_large").cable_set().without_pulleys())
    N = null_space(J.T)
    norms = {
        f"E{number}": (float(np.linalg.norm(N.T @ tensions)), float(np.linalg.norm(eta)))
        for (number, tensions), eta in zip(TENSIONS.items(), ETAS.values(), strict=True)
    }
    words = ", ".join(f"{name} {ours:.2f} ({eta:.2f})" for name, (ours, eta) in norms.items())
    held = [abs(ours - eta) <= ROUNDING for ours, eta in norms.values()]
    return held, f"|N't|, in brackets the printed |eta| [N]: {words}"


def undisturbed(rows: Frame) -> tuple[list[bool], str]:
    """How far lengths and velocities of C5 and C6 in E6 and E10 are from those of E2."""
    rows = projected(rows)
    runs = {(row["configuration"], row["seed"]): row["arrays"] for row in rows.to_dict("records")}
    held, words = [], []
    for name in ("E6", "E10"):
        pairs = [(runs[name, k], runs["E2", k]) for n, k in runs if n == name and ("E2", k) in runs]
        if not pairs:
            raise MissingRuns(f"{name} and E2")
        length, velocity = (
            float(np.mean([reduce(np.abs(_change(a, b, key))) for a, b in pairs]))
            for key, reduce in (("unstrained_lengths", np.max), ("cable_velocities", np.mean))
        )
        held += [length < 0.005, velocity < 0.01]
        words.append(f"{name} at most {1e3 * length:.1f} mm, mean {1e3 * velocity:.1f} mm/s")
    return held, "; ".join(words)


def _change(first: Mapping[str, Array], second: Mapping[str, Array], key: str) -> Array:
    count = min(len(first["time"]), len(second["time"]))
    return np.asarray(first[key][:count, 4:6] - second[key][:count, 4:6])


WORST = {"time_to_taut_s": "max", "estimate_max_m": "max", "image_max_px": "max",
         "cable_power_w": "mean", "chatter_n": "mean", "underactuated_s": "max",
         "least_margin_taut": "min"}  # fmt: skip
"""What tells ways apart, and which number of the runs counts."""


def ways(rows: Frame) -> Frame:
    """Every way to take up 4 cm of slack beside the others.

    Usable: every run has its slack gone within 2 s, an estimate within 60 mm, and a positive margin
    from then on.
    """
    mine = projected(rows)
    mine = mine[mine["configuration"].isin(list(COMPARED))]
    if not len(mine):
        raise MissingRuns("ways to take up slack")
    table = mine.groupby("configuration", sort=False).agg(WORST)
    table = table.reindex([name for name in COMPARED if name in table.index])
    table["usable"] = (
        (table["time_to_taut_s"] < 2.0)
        & (table["estimate_max_m"] < 0.06)
        & (table["least_margin_taut"] > 0.0)
    )
    return table.reset_index()


def which_to_take(rows: Frame) -> Frame:
    """The same in words and the units of the thesis."""
    table = ways(rows)
    return Frame({
        "way": table["configuration"].map(COMPARED),
        "usable": np.where(table["usable"], "yes", "no"),
        "slack gone, latest [s]": table["time_to_taut_s"],
        "estimate, largest [mm]": 1e3 * table["estimate_max_m"],
        "image, largest [px]": table["image_max_px"], "cable power [W]": table["cable_power_w"],
        "chatter [N]": table["chatter_n"], "underactuated [s]": table["underactuated_s"],
        "least margin": table["least_margin_taut"],
    })  # fmt: skip


def simple_way_suffices(rows: Frame) -> tuple[list[bool], str]:
    """Whether the simplest way is usable, and no usable one is a fifth better in something."""
    table = ways(rows).set_index("configuration")
    if "E6" not in table.index:
        raise MissingRuns("E6")
    usable = table[table["usable"]]
    columns = [name for name in WORST if name != "least_margin_taut"]
    better = {
        COMPARED[name]: [c for c in columns if usable.loc[name, c] < 0.8 * table.loc["E6", c]]
        for name in usable.index
        if name != "E6"
    }
    clearly = [f"{name} ({', '.join(columns)})" for name, columns in better.items() if columns]
    words = f"usable: {', '.join(COMPARED[name] for name in usable.index) or 'none'}"
    held = ["E6" in usable.index, not clearly]
    return held, f"{words}; better by more than a fifth: {'; '.join(clearly) or 'none'}"


STUDY = servo_study(
    name="case-9",
    title="Slack cables on ACROBOT, with and without tension correction",
    source="servoing thesis 5.3.1, figures 5.11 to 5.18, table 5.1",
    scenario="acrobot_slack_start",
    configurations=configurations(),
    changes=(
        "perturbations.initial_pose_shift={distance: 0.02, angle_deg: 1.5}",
        *wrong_points(),
        "sensors.log=[tension]",
        "integration.engine=compiled",
        "duration=10",
    ),
    rendered=("E6",),
    repetitions=10,
    stability=THRESHOLD,
    metrics=case_9_numbers,
    columns=(
        "time_to_taut_s", "underactuated_s", "estimate_end_m", "estimate_end_rad", "winch_work_j",
        "chatter_n", "correction_m", "least_rank_late", "least_margin_late", "least_margin_taut",
    ),
    assumptions=(
        "Stiffness and damping of the cables as mounted are not printed: a hundredth of the "
        "modulus of the fibre, and a retardation time of 2 ms, are fitted: the printed gain of the "
        "correction is stable with them, and times and tensions of E1, E2, E5, E6, E9 and E10 were "
        "in sight; three other stiffnesses are run beside it.",
        "The centre of mass of the platform is not printed: its height is fitted to table 5.1, see "
        "the robot's file; two others are run beside it.",
        "The pose of the tag follows from the printed poses of the platform and of the tag in the "
        "camera at the start; the platform's at the end follows from that, 13 mm and 17 deg from "
        "the printed one.",
        "What controller and estimator believe wrongly is not printed: the first pose by 20 mm and "
        "1.5 deg; exit and anchor points by 5 mm, the manufacturing errors of 3.3.3 and 4.3.1, in "
        "directions drawn for each seed.",
        "Tensions are read by the prototype's sensors, with their published errors.",
        "The robot is moved by the compiled engine, see `cdpr study engines`.",
    ),
    finds={
        "distances_from_table": distances_from_table,
        "norms_of_etas": norms_of_etas,
        "undisturbed": undisturbed,
        "simple_way_suffices": simple_way_suffices,
    },
    tables={"Which way to take up 4 cm of slack": which_to_take},
    figures=FIGURES,
)  # fmt: skip
