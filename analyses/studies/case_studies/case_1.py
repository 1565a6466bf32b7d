"""Case study I: ways to know the platform's pose, in pose-based visual servoing."""

from __future__ import annotations

import numpy as np

from cdpr_drake.analyses.studies.case_studies.case_1_ends import (
    ENDS,
    FACTOR,
    LENGTHS,
    POINTS,
    TO_GOAL,
    accuracy_figure,
    met,
    to_goal,
)
from cdpr_drake.analyses.studies.case_studies.case_1_figures import CASE_1_LAYOUTS
from cdpr_drake.analyses.studies.case_studies.case_4 import (
    AS_PRINTED,
    CAROCA_SERVO,
    LIFT,
    PRINTED_BELIEF,
    lowered,
)
from cdpr_drake.analyses.studies.framework.caroca_cables import CAROCA_ASSUMPTION, CAROCA_RUN
from cdpr_drake.analyses.studies.framework.case_definition import PULLEYS, Configuration, Plan
from cdpr_drake.analyses.studies.framework.case_run import converged, outcomes
from cdpr_drake.analyses.studies.framework.case_study import configuration_study
from cdpr_drake.analyses.studies.framework.experiments import as_transform, pose_item
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import (
    CHOICE,
    FITTED,
    HARDWARE,
    SOURCE,
    Finding,
    statement,
)

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

IMAGE = ("2", "3")

OPEN_LOOP = "open loop"
ACROBOT = "ACROBOT"
ACROBOT_PERTURBED = "ACROBOT perturbed"
CAROCA = "CAROCA"
CAROCA_PERTURBED = "CAROCA perturbed"
CAROCA_RAISED = "CAROCA perturbed raised"
MOVING = "moving object"

ACROBOT_BELIEF = as_transform(((0.056, -0.077, 0.308), (-6.0, -12.0, -5.0)))
"""Printed assumed pose of section 2.3.3, 0.072 m and 7 deg wrong."""

PERTURBED = pose_item("perturbations.initial_pose", ACROBOT_BELIEF)
CAROCA_WRONG_RAISED = (
    *CAROCA_SERVO, *CAROCA_RUN, pose_item("perturbations.initial_pose", PRINTED_BELIEF),
)  # fmt: skip
"""Section 2.3.5, raised so that the tag lies on the ground."""

CAROCA_WRONG = (
    *CAROCA_WRONG_RAISED[:-1],
    *AS_PRINTED,
    pose_item("perturbations.initial_pose", lowered(PRINTED_BELIEF, LIFT)),
)
"""Section 2.3.5 with the printed heights."""

RADII = (0.16, 0.12)
"""Half axes of the moving object's path on the ground along x and y of W [m]."""

ABOUT_A_CENTIMETRE = 7.0
"""Errors from here on count as about a centimetre [mm]."""

LAP = 16.0
"""Printed time of a lap [s]."""

MOVING_TIME = 15.0 * LAP
"""When a run behind the moving object is stopped: beyond all printed times, 210 s at most [s]."""

PRINTED_LAPS = {"1": 12.0, "4": 2.0, "5": 3.0, "6": 3.0, "7": 4.0}
"""Laps after which the task fails, by estimator. Source: section 2.3.7."""


def _lap(corners: int = 16) -> str:
    """Waypoints of a lap, as an item."""
    points = []
    for k in range(1, corners + 1):
        phase = 2.0 * np.pi * k / corners
        x, y = RADII[0] * np.cos(phase), RADII[1] * np.sin(phase)
        points.append(
            f"{{time: {LAP * k / corners:g}, pose: {{position: [{x:.6g}, {y:.6g}, 0.0]}}}}"
        )
    return "target.motion={repeat: true, waypoints: [" + ", ".join(points) + "]}"


FOLLOWING = (
    "robot=acrobot_large",
    "initial_pose={position: [0.2231, 0, 0.15], angles_deg: [0, 0, 0]}",
    "desired={position: [0, 0, 0.16], angles_deg: [180, 0, 180]}",
    f"target.pose={{position: [{RADII[0]:g}, 0, 0]}}",
    "stop={position: 1.0e-9, rotation_deg: 1.0e-6}",
    "controller.lambda_0=2",
    "controller.lambda_infinity=2",
    f"duration={MOVING_TIME:g}",
    *POINTS,
    _lap(),
)
"""The platform stays above an object that runs on an ellipse, and never arrives."""


def _group(
    group: str,
    prefix: str,
    keys: tuple[str, ...],
    changes: tuple[str, ...],
    published: dict[str, dict[str, str]],
    scenario: str | None = None,
    *,
    why: str = "",
    cause: str = "",
) -> tuple[Configuration, ...]:
    return tuple(
        Configuration(
            f"{prefix}_{key}",
            ESTIMATORS[key][1],
            (*changes, f"estimator.kind={ESTIMATORS[key][0]}"),
            group=group,
            scenario=scenario,
            published=published.get(key, {}),
            why=why,
            cause=cause,
        )
        for key in keys
    )


def _names(prefix: str, keys: tuple[str, ...]) -> list[str]:
    return [f"{prefix}_{key}" for key in keys]


@statement(
    "Without visual servoing, control integration and cable lengths say that the plan was "
    "followed, which it was not, by about a centimetre; they hardly differ.",
    "14 and 12.1 mm",
    cause=SOURCE,
)
def _open_loop(runs: Runs) -> Finding:
    error = {key: 1e3 * runs.mean("estimate_max_m", configuration=f"o_{key}") for key in "1234567"}
    near = [error[key] for key in ("1", *LENGTHS)]
    return Finding(
        found=", ".join(f"{key}: {value:.1f}" for key, value in error.items()) + " mm",
        held=[max(near) < 1.5 * min(near), min(near) > ABOUT_A_CENTIMETRE],
        some=min(near) > 1.0,
        why="The wrong points of the cables are drawn anew in each run.",
    )


@statement(
    "Without visual servoing estimates end nearly right, since the platform comes back to "
    "where it began.",
    "Est. 1 1.3 mm, 0.55 deg; by lengths 1 mm, 0.55 deg",
    rule=f"Confirmed within a factor {FACTOR:g}; in part: less than half of the largest error on "
    "the way. Wrong points of the cables are drawn for each run.",
    cause=SOURCE,
)
def returns(runs: Runs) -> Finding:
    """Section 2.3.1: where the platform comes back to, the estimate is right again."""
    ends = {
        key: [1e3 * run["estimate_distance"][-1] for run in runs(configuration=f"o_{key}")]
        for key in ("1", *LENGTHS)
    }
    angles = {
        key: [np.degrees(run["estimate_angle"][-1]) for run in runs(configuration=f"o_{key}")]
        for key in ends
    }
    far = {key: float(np.mean(values)) for key, values in ends.items()}
    turned = {key: float(np.mean(values)) for key, values in angles.items()}
    most = {key: 1e3 * runs.mean("estimate_max_m", configuration=f"o_{key}") for key in ends}
    close = [met(far[key], 1.3 if key == "1" else 1.0) and met(turned[key], 0.55) for key in far]
    return Finding(
        found=", ".join(
            f"{key}: {far[key]:.1f} ({min(ends[key]):.1f} to {max(ends[key]):.1f}) mm, "
            f"{turned[key]:.2f} deg"
            for key in far
        ),
        held=close,
        some=all(far[key] < most[key] / FACTOR for key in far),
    )


@statement(
    "On ACROBOT, all estimators keep the object within 15 px of the straight line.",
    "at most 15 px; Est. 1, 2, 3 at most 10 px",
    cause=HARDWARE,
)
def _all_straight(runs: Runs) -> Finding:
    image = {key: runs.mean("image_max_px", configuration=f"a_{key}") for key in "1234567"}
    return Finding(
        found=", ".join(f"{key}: {value:.1f}" for key, value in image.items()) + " px",
        held=[value <= 15.0 for value in image.values()],
    )


@statement(
    "On CAROCA, the estimates from images are the worst, those with pulleys the best.",
    "images beyond 0.1 m, Est. 1, 4, 5 about 0.07 m, Est. 6, 7 below 0.04 m",
    cause=HARDWARE,
)
def _images_worst(runs: Runs) -> Finding:
    error = {key: 1e3 * runs.mean("estimate_max_m", configuration=f"c_{key}") for key in "1234567"}
    others = [error[key] for key in error if key not in IMAGE]
    return Finding(
        found=", ".join(f"{key}: {value:.0f}" for key, value in error.items()) + " mm",
        held=[
            min(error[key] for key in IMAGE) > max(others),
            max(error["6"], error["7"]) < min(error["1"], error["4"], error["5"]),
        ],
        some=max(error["6"], error["7"]) < min(error["1"], error["4"], error["5"]),
        why="What an image estimates is as good as the image's object: here the corners carry 0.1 "
        "px of noise and the camera's parameters are exact, the prototype's were not.",
    )


@statement(
    "On CAROCA with a wrong initial pose, the task fails with the estimates from images only.",
    "section 2.3.5",
    basis=FITTED,
    cause=CHOICE,
)
def _images_fail(runs: Runs) -> Finding:
    ends = {key: outcomes(runs, f"cp_{key}") for key in "1234567"}
    images = [converged(runs, f"cp_{key}") for key in IMAGE]
    rest = [converged(runs, f"cp_{key}") for key in ("1", *LENGTHS)]
    return Finding(
        found="; ".join(f"{key}: {words}" for key, words in ends.items()),
        held=[not any(images), all(rest)],
        some=not any(images),
        why="Of the others these fail, too: "
        + (", ".join(k for k in ("1", *LENGTHS) if not converged(runs, f"cp_{k}")) or "none")
        + f". Raised by {LIFT:g} m, so that the tag lies on the ground: "
        + "; ".join(f"{k}: {outcomes(runs, f'cr_{k}')}" for k in "1234567")
        + ". The damping of CAROCA is fitted to runs that converge.",
    )


@statement(
    "With a wrong initial pose on CAROCA, the estimates from images are the worst: their "
    "error grows.",
    "figure 2.10c",
    cause=HARDWARE,
)
def _images_worst_perturbed(runs: Runs) -> Finding:
    error = {key: 1e3 * runs.mean("estimate_max_m", configuration=f"cp_{key}") for key in "1234567"}
    worst = sorted(error, key=lambda key: -error[key])[:2]
    return Finding(
        found=", ".join(f"{key}: {value:.0f}" for key, value in error.items()) + " mm",
        held=[key in worst for key in IMAGE],
    )


@statement(
    "Estimates from cable lengths jump where slack moves between cables; control integration "
    "does not.",
    "figures 2.12, 2.17",
    rule="Largest change of the estimate's error between two rows of the log, 0.02 s apart",
    cause=HARDWARE,
)
def _jumps(runs: Runs) -> Finding:
    pairs = {
        "moving object": [
            1e3 * runs.mean("estimate_jump_m", configuration=f"m_{key}") for key in ("1", "4")
        ],
        "CAROCA": [
            1e3 * runs.mean("estimate_jump_m", configuration=f"cp_{key}") for key in ("1", "4")
        ],
    }
    return Finding(
        found="; ".join(
            f"{name}: control {a:.2f}, lengths {b:.2f} mm" for name, (a, b) in pairs.items()
        ),
        held=[b > 3.0 * a for a, b in pairs.values()],
    )


@statement(
    "Following a moving object, control integration lasts longest (12 laps), then Est. 7 (4), "
    "Est. 5 and 6 (3), Est. 4 (2).",
    "section 2.3.7",
    rule="Estimators that last until the run is stopped are not told apart, and have not failed as "
    f"stated. Confirmed: this order, and laps within a factor of {FACTOR:g}.",
    cause=SOURCE,
)
def moving(runs: Runs) -> Finding:
    """Which estimator follows the moving object longest; lasting to the end is no order."""
    laps = {key: runs.mean("time_s", configuration=f"m_{key}") / LAP for key in PRINTED_LAPS}
    lasting = {
        k for k in laps if any(run["outcome"] == "timeout" for run in runs(configuration=f"m_{k}"))
    }
    first = laps["1"] > max(laps[key] for key in LENGTHS) and not lasting & set(LENGTHS)
    order = laps["7"] > max(laps["5"], laps["6"]) and min(laps["5"], laps["6"]) > laps["4"]
    return Finding(
        found=", ".join(f"{key}: {value:.1f}" for key, value in laps.items())
        + f" laps of at most {MOVING_TIME / LAP:g}; "
        + "; ".join(f"{key}: {outcomes(runs, f'm_{key}')}" for key in laps),
        held=[
            first,
            order,
            not lasting,
            all(met(laps[key], printed) for key, printed in PRINTED_LAPS.items()),
        ],
        some=first,
        why="Points of the cables are wrong by the printed 5 mm, winches do what they are told. "
        f"Est. 1 is {1e3 * runs.largest('estimate_max_m', configuration='m_1'):.0f} mm wrong at "
        "most, where almost 0.3 m are printed. What accumulated on the prototype is not printed; "
        "study mobile-robot has winches that run off, fitted to that drift.",
    )


_SEVEN = tuple("1234567")

PRINTED_OPEN_LOOP = {
    "1": {"estimate_max_m": "14", "estimate_max_rad": "1.6"},
    **{key: {"estimate_max_m": "12", "estimate_max_rad": "1.6"} for key in LENGTHS},
}
"""Section 2.3.1, figure 2.2b."""

PRINTED_ACROBOT = {
    **{key: {"image_max_px": "at most 15"} for key in LENGTHS},
    **{key: {"image_max_px": "at most 10"} for key in IMAGE},
    "1": {
        "image_max_px": "at most 10",
        "estimate_max_m": "at most 9",
        "estimate_max_rad": "at most 2",
    },
}
"""Section 2.3.2, figure 2.4: bounds that the values stay below."""

EXACT = (
    "what an image estimates is as good as the image: here corners carry 0.1 px of noise and the "
    "camera's parameters are exact; lengths are as good as the simulated robot"
)
"""Why ours are smaller than the prototypes'."""

STUDY = configuration_study(
    Plan(
        name="case-1",
        title="Estimates of the platform's pose in PBVS",
        scenario="acrobot_pbvs",
        changes=(PULLEYS,),
        laps_s={MOVING: LAP},
        configurations=(
            *_group(
                OPEN_LOOP,
                "o",
                (*_SEVEN, "f"),
                ("estimator.compare=[]",),
                PRINTED_OPEN_LOOP,
                "acrobot_open_loop",
            ),
            *_group(
                ACROBOT,
                "a",
                (*_SEVEN, "m", "f"),
                (),
                PRINTED_ACROBOT,
                why=EXACT,
                cause=HARDWARE,
            ),
            *to_goal(ESTIMATORS),
            *_group(ACROBOT_PERTURBED, "ap", (*_SEVEN, "f"), (PERTURBED,), {}),
            *_group(
                CAROCA,
                "c",
                (*_SEVEN, "f"),
                CAROCA_RUN,
                {
                    "1": {"estimate_max_m": "70"},
                    "2": {"image_max_px": "35", "estimate_max_m": "> 100"},
                    "3": {"image_max_px": "35", "estimate_max_m": "> 100"},
                    "6": {"estimate_max_m": "at most 40"},
                    "7": {"estimate_max_m": "at most 40"},
                },
                "caroca_pbvs",
                why=EXACT,
                cause=HARDWARE,
            ),
            *_group(
                CAROCA_PERTURBED,
                "cp",
                (*_SEVEN, "f"),
                CAROCA_WRONG,
                {"2": {"outcome": "fails"}, "3": {"outcome": "fails"}},
                "caroca_pbvs",
            ),
            *_group(CAROCA_RAISED, "cr", _SEVEN, CAROCA_WRONG_RAISED, {}, "caroca_pbvs"),
            *_group(
                MOVING,
                "m",
                ("1", *LENGTHS, "f"),
                FOLLOWING,
                {"1": {"time_s": "210"}, "7": {"time_s": "70"}},
            ),
        ),
        rendered=("a_1", "a_7", "c_1"),
        layouts=CASE_1_LAYOUTS,
        why="how the points of the cables are wrong and which way the object takes is not printed",
        cause=SOURCE,
    ),
    source="servoing thesis 2.3, figures 2.4 to 2.18, table 2.1",
    assumptions=(
        "The simulated robots have pulleys and elastic cables; which of them an estimator knows is "
        "its own matter. The controller's model has neither.",
        CAROCA_ASSUMPTION,
        "Meas. 1: the tracker's errors per distance and per angle are fitted to the 12 mm and 5 mm "
        "printed for these runs (section 2.3.2), so its error at the start and at the end is no "
        "comparison. What they make of the paths was not fitted.",
        f"Section 2.3.5: the printed heights put the tag {LIFT:g} m below the ground; they are "
        "kept, and raised by as much in the experiment beside it.",
        f"Figure 2.14 ({TO_GOAL}): points of the cables wrong by 5 mm as in section 2.3.1, "
        "for both controllers; which six of the seven estimators is not said: Est. 1 to 6.",
        "Moving object: an ellipse of 0.32 m x 0.24 m, 16 s a lap, at most 15 laps; the way of "
        "the mobile robot is not printed. Points of the cables wrong by 5 mm as in section 2.3.1.",
    ),
    drawings={"accuracy_at_goal": accuracy_figure},
    checks=(
        _open_loop,
        returns,
        _all_straight,
        _images_worst,
        _images_fail,
        _images_worst_perturbed,
        _jumps,
        moving,
        *ENDS,
    ),
)
