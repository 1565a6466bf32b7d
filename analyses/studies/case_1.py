"""Study: case I of the servoing thesis, estimates of the platform's pose in PBVS."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from cdpr_drake.analyses.studies.caroca_cases import (
    AS_PRINTED,
    LIFT,
    PRINTED_BELIEF,
    SERVO,
    lowered,
)
from cdpr_drake.analyses.studies.case_1_figures import FIGURES
from cdpr_drake.analyses.studies.experiments import (
    as_transform,
    pose_item,
    wrong_points,
)
from cdpr_drake.analyses.studies.facts import MissingRuns
from cdpr_drake.analyses.studies.servo import (
    CAROCA_ASSUMPTION,
    CAROCA_RUN,
    PULLEYS,
    Configuration,
    servo_study,
)
from cdpr_drake.analyses.studies.study import Frame
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.pose_accuracy import repeatability
from cdpr_drake.geometry.poses import pose_from_row

ESTIMATORS = {
    "1": ("control_integration", "Est. 1, control"),
    "2": ("consecutive_images", "Est. 2, two images"),
    "3": ("first_image", "Est. 3, first image"),
    "4": ("cable_lengths", "Est. 4, lengths"),
    "5": ("cable_lengths_elastic", "Est. 5, elastic"),
    "6": ("cable_lengths_pulleys", "Est. 6, pulleys"),
    "7": ("cable_lengths_elastic_pulleys", "Est. 7, both"),
    "m": ("measured", "Meas. 1, tracker (fitted)"),
    "f": ("fusion", "fusion (not in the thesis)"),
}
"""Estimators by the thesis' numbers: name in a scenario, label."""

BELIEF = as_transform(((0.056, -0.077, 0.308), (-6.0, -12.0, -5.0)))
"""Printed assumed pose of section 2.3.3, 0.072 m and 7 deg wrong."""

RAISED = (*SERVO, pose_item("perturbations.initial_pose", PRINTED_BELIEF))
"""Section 2.3.5, raised so that the tag lies on the ground."""

PRINTED_HEIGHTS = (
    *SERVO, *AS_PRINTED, pose_item("perturbations.initial_pose", lowered(PRINTED_BELIEF, LIFT)),
)  # fmt: skip
"""Section 2.3.5."""

POINTS = wrong_points()
"""What the model has wrong in section 2.3.1, for both controllers."""

BLIND = "open_loop={waypoints: [{pose: {position: [0.284, -0.197, 0.08]}, duration: 10}]}"
"""Section 2.3.1, to its first goal."""

RADII = (0.16, 0.12)
"""Half axes of the moving object's path on the ground along x and y of W [m]."""

LAP, MOST_LAPS = 16.0, 15
"""Printed time of a lap [s], and how many a run has at most: more than in the printed 210 s."""


def lap(corners: int = 16) -> str:
    """Waypoints of a lap, as an item."""
    points = []
    for k in range(1, corners + 1):
        phase = 2.0 * np.pi * k / corners
        x, y = RADII[0] * np.cos(phase), RADII[1] * np.sin(phase)
        pose = f"{{position: [{x:.6g}, {y:.6g}, 0.0]}}"
        points.append(f"{{time: {LAP * k / corners:g}, pose: {pose}}}")
    return f"target.motion={{repeat: true, waypoints: [{', '.join(points)}]}}"


FOLLOWING = (
    "robot=acrobot_large",
    "initial_pose={position: [0.2231, 0, 0.15], angles_deg: [0, 0, 0]}",
    "desired={position: [0, 0, 0.16], angles_deg: [180, 0, 180]}",
    f"target.pose={{position: [{RADII[0]:g}, 0, 0]}}",
    "stop={position: 1.0e-9, rotation_deg: 1.0e-6}",
    "controller.lambda_0=2",
    "controller.lambda_infinity=2",
    f"duration={MOST_LAPS * LAP:g}",
    *POINTS,
    lap(),
)
"""The platform stays above an object that runs on an ellipse, and never arrives."""


def estimators(
    group: str, prefix: str, keys: str, changes: Sequence[str] = (), scenario: str = "",
    words: str = "",
) -> list[Configuration]:  # fmt: skip
    """A configuration for each of some estimators."""
    return [
        Configuration(
            f"{prefix}_{key}", words + ESTIMATORS[key][1],
            (*changes, f"estimator.kind={ESTIMATORS[key][0]}"), group, scenario,
        )
        for key in keys
    ]  # fmt: skip


CONFIGURATIONS = (
    *estimators("open loop", "o", "1234567f", ("estimator.compare=[]",), "acrobot_open_loop"),
    *estimators("ACROBOT", "a", "1234567mf"),
    Configuration("g_blind", "open loop", (*POINTS, BLIND), "one goal", repetitions=10),
    *estimators("one goal", "g", "123456", POINTS, words="PBVS, "),
    *estimators(
        "ACROBOT perturbed", "ap", "1234567f", (pose_item("perturbations.initial_pose", BELIEF),)
    ),
    *estimators("CAROCA", "c", "1234567f", CAROCA_RUN, "caroca_pbvs"),
    *estimators("CAROCA perturbed", "cp", "1234567f", PRINTED_HEIGHTS, "caroca_pbvs"),
    *estimators("CAROCA perturbed raised", "cr", "1234567", RAISED, "caroca_pbvs"),
    *estimators("moving object", "m", "14567f", FOLLOWING),
)


def estimate_numbers(curves: Mapping[str, Array]) -> dict[str, float]:
    """Error of the estimate at the end and in the mean of a run."""
    distance, angle = curves["estimate_distance"], curves["estimate_angle"]
    return {
        "estimate_end_m": float(distance[-1]), "estimate_end_rad": float(angle[-1]),
        "estimate_mean_m": float(np.mean(distance)), "estimate_mean_rad": float(np.mean(angle)),
    }  # fmt: skip


TABLE_2_1 = {
    "position": {"a": (1.0, 1.7), "ap": (0.9, 1.9), "c": (1.5, None), "cp": (1.6, None)},
    "rotation": {"a": (0.42, 0.68), "ap": (0.49, 0.59), "c": (0.17, None), "cp": (0.31, None)},
}
"""Repeatability and accuracy of final positions [mm] and rotations [deg]: ACROBOT, perturbed,
CAROCA, perturbed."""


def final_poses(rows: Frame, prefix: str, of: str) -> tuple[float, float, int]:
    """Repeatability and accuracy [mm] or [deg] of a row of table 2.1, all estimators together, and
    how many runs converged; infinite if none did.

    Raises:
        MissingRuns: One of its configurations was not run.
    """
    names = [f"{prefix}_{key}" for key in ("14567" if prefix == "cp" else "1234567")]
    runs = rows[rows["configuration"].isin(names)]
    if runs["configuration"].nunique() < len(names):
        raise MissingRuns(f"{prefix} of table 2.1")
    ends = [arrays["camera_ends"] for arrays in runs["arrays"][runs["outcome"] == "converged"]]
    if not ends:
        return np.inf, np.inf, 0
    reached = repeatability([pose_from_row(end) for end, _ in ends], pose_from_row(ends[0][1]))
    if of == "position":
        return 1e3 * reached.repeatability, 1e3 * reached.accuracy, len(ends)
    turns = np.degrees([reached.rotation_repeatability, reached.rotation_accuracy])
    return float(turns[0]), float(turns[1]), len(ends)


def final_accuracy(rows: Frame, of: str) -> tuple[list[bool], str]:
    """Table 2.1 within a factor of two; far better than printed is another robot, too."""
    held, words = [], []
    for prefix, printed in TABLE_2_1[of].items():
        *numbers, count = final_poses(rows, prefix, of)
        words.append(f"{prefix} {numbers[0]:.3g} and {numbers[1]:.3g} ({count} runs)")
        held += [
            size / 2.0 <= number <= 2.0 * size
            for number, size in zip(numbers, printed, strict=True)
            if size is not None
        ]
    unit = "mm" if of == "position" else "deg"
    return held, f"{', '.join(words)} {unit}; a ACROBOT, c CAROCA, p perturbed"


STUDY = servo_study(
    name="case-1",
    title="Estimates of the platform's pose in PBVS",
    source="servoing thesis 2.3, figures 2.4 to 2.18, table 2.1",
    scenario="acrobot_pbvs",
    changes=(PULLEYS,),
    configurations=CONFIGURATIONS,
    laps={"moving object": LAP},
    rendered=("a_1", "a_7", "c_1"),
    metrics=estimate_numbers,
    finds={f"final_{of}": partial(final_accuracy, of=of) for of in TABLE_2_1},
    assumptions=(
        "The simulated robots have pulleys and elastic cables; which of them an estimator knows is "
        "its own matter. The controller's model has neither.",
        CAROCA_ASSUMPTION,
        "Meas. 1: the tracker's errors per distance and per angle are fitted to the 12 mm and 5 mm "
        "printed for these runs (section 2.3.2), so its error at the start and at the end is no "
        "comparison. What they make of the paths was not fitted.",
        f"Section 2.3.5: the printed heights put the tag {LIFT:g} m below the ground; they are "
        "kept, and raised by as much in the experiment beside it.",
        "Figure 2.14 (one goal): points of the cables wrong by 5 mm as in section 2.3.1, "
        "for both controllers; which six of the seven estimators is not said: Est. 1 to 6.",
        "Moving object: an ellipse of 0.32 m x 0.24 m, 16 s a lap, at most 15 laps; the way of "
        "the mobile robot is not printed. Points of the cables wrong by 5 mm as in section 2.3.1.",
    ),
    figures=FIGURES,
)
