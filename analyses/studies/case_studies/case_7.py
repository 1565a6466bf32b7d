"""Case study VII: planning and tracking the path of the features, on ACROBOT."""

from __future__ import annotations

from cdpr_drake.analyses.studies.case_studies.path_figures import TRACKING_LAYOUTS
from cdpr_drake.analyses.studies.framework.case_definition import PULLEYS, Configuration, Plan
from cdpr_drake.analyses.studies.framework.case_statements import same_accuracy
from cdpr_drake.analyses.studies.framework.case_study import configuration_study
from cdpr_drake.analyses.studies.framework.experiments import (
    DIRECTIONS,
    SETS,
    SETUP,
    TIME,
    TRACKING,
)
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import (
    HARDWARE,
    SOURCE,
    Finding,
    statement,
)


def _why(name: str) -> str:
    """What is known of how far runs with a perturbation set may be off."""
    if name == "none":
        return ""
    if name == "d1":
        return (
            "d1 is printed whole, so that its directions are no reason; by what the prototype's "
            f"path in the image is straighter is not known. The way is planned for {TIME:g} s here"
        )
    return (
        "directions of the shifts are not printed and drawn for each run, and how far a path is "
        "off depends on them"
    )


def _pairs() -> tuple[Configuration, ...]:
    made = []
    for name, changes in SETS.items():
        words = "no perturbation" if name == "none" else name
        clean = (
            {"image_max_px": "at most 10", "camera_max_m": "at most 10"} if name == "none" else {}
        )
        shown = {} if name == "none" else {"image_max_px": "18 or less"}
        made += [
            Configuration(f"{name}_servo", f"{words}, 2 1/2 D", changes, published=clean),
            Configuration(
                f"{name}_tracking",
                f"{words}, tracking",
                (*changes, *TRACKING),
                published=clean or shown,
                why=_why(name),
            ),
        ]
    return tuple(made)


PAIRS = _pairs()

FACTOR = 2.0
"""A number within this factor of the printed one, below or above, counts as met."""

SIMULATED = "simulated"
"""Group of the runs without pulleys, as the simulation of the thesis has none."""

SIMULATED_SETS = ("none", "d2")


def _simulated() -> tuple[Configuration, ...]:
    printed = {
        "none_servo": {"image_max_px": "at most 5", "camera_max_m": "at most 7"},
        "none_tracking": {"image_max_px": "at most 5", "camera_max_m": "at most 7"},
        "d2_servo": {"image_max_px": "below 20", "camera_max_m": "60"},
        "d2_tracking": {"image_max_px": "at most 5", "camera_max_m": "at most 10"},
    }
    return tuple(
        Configuration(
            f"simulated_{pair.name}",
            f"{pair.label}, no pulleys",
            (*pair.changes, "cables.pulleys=false"),
            group=SIMULATED,
            published=printed[pair.name],
        )
        for pair in PAIRS
        if pair.name in printed
    )


@statement(
    "Simulated without pulleys: straight without perturbation; with d2 the camera's path "
    "deviates, and with tracking it does not.",
    "at most 5 px and 7 mm; with d2 below 20 px, almost 60 mm; with tracking at most 5 px and "
    "10 mm",
    rule=f"Almost 60 mm: within a factor {FACTOR:g}",
    cause=SOURCE,
)
def simulation(runs: Runs) -> Finding:
    """Section 4.3.2, figure 4.3."""
    names = [
        f"simulated_{name}_{kind}" for name in SIMULATED_SETS for kind in ("servo", "tracking")
    ]
    image = runs.means("image_max_px", configuration=names)
    camera = 1e3 * runs.means("camera_max_m", configuration=names)
    good = [
        max(image[:2]) <= 5.0,
        max(camera[:2]) <= 7.0,
        image[2] < 20.0,
        60.0 / FACTOR <= camera[2] <= 60.0 * FACTOR,
        image[3] <= 5.0,
        camera[3] <= 10.0,
    ]
    return Finding(
        found="; ".join(
            f"{name} {px:.1f} px, {mm:.1f} mm"
            for name, px, mm in zip(names, image, camera, strict=True)
        ),
        held=good,
        why="Its camera is pixelated, by how much is not printed; ours has noise of 0.1 px in the "
        "corners. Nor are the directions of what is wrong in d2.",
    )


def _ratio(runs: Runs, name: str, metric: str) -> float:
    servo, tracking = runs.means(metric, configuration=(f"{name}_servo", f"{name}_tracking"))
    return float(servo / tracking)


@statement(
    "With tracking, the deviations under d1 to d4 are two to three times smaller, or better.",
    "figure 4.6",
    rule="Confirmed: two times at least in all eight; in part: in all four of the image or of the "
    "camera",
    cause=SOURCE,
)
def _better(runs: Runs) -> Finding:
    names = ("d1", "d2", "d3", "d4")
    image = [_ratio(runs, name, "image_max_px") for name in names]
    camera = [_ratio(runs, name, "camera_max_m") for name in names]
    return Finding(
        found="image "
        + ", ".join(f"{r:.1f}" for r in image)
        + " times, camera "
        + ", ".join(f"{r:.1f}" for r in camera)
        + " times smaller",
        held=[min(image) >= 2.0, min(camera) >= 2.0],
        why="How far the path is off without tracking depends on the directions of the "
        "perturbations, of which only those of d1 are printed.",
    )


@statement(
    "Without perturbation, both stay close to the straight lines.",
    "at most 10 px and 10 mm",
    cause=SOURCE,
    why="What is wrong on the prototype without added perturbation is not printed.",
)
def _same_without(runs: Runs) -> Finding:
    image = [
        runs.largest("image_max_px", configuration=f"none_{kind}") for kind in ("servo", "tracking")
    ]
    camera = [
        1e3 * runs.largest("camera_max_m", configuration=f"none_{kind}")
        for kind in ("servo", "tracking")
    ]
    return Finding(
        found=f"at most {image[0]:.1f} and {image[1]:.1f} px, {camera[0]:.1f} and "
        f"{camera[1]:.1f} mm",
        held=[max(image) <= 10.0, max(camera) <= 10.0],
        some=min(image) <= 10.0,
    )


@statement(
    "With tracking, the camera's path stays about as without perturbation, whatever the set.",
    "figures 4.4c, 4.5c",
    rule="About the same: less than twice that without perturbation; in part: below the 10 mm "
    "that are printed for runs without perturbation",
    cause=HARDWARE,
)
def _space(runs: Runs) -> Finding:
    found = 1e3 * runs.means("camera_max_m", configuration=[f"{s}_tracking" for s in SETS])
    return Finding(
        found=", ".join(f"{name} {value:.1f}" for name, value in zip(SETS, found, strict=True))
        + " mm",
        held=[max(found) < 2.0 * found[0]],
        some=max(found) < 10.0,
        why="Ours without perturbation are straighter than those of the prototype, which makes "
        "twice of it less.",
    )


_accuracy = same_accuracy([pair.name for pair in PAIRS], "chapter 4")


STUDY = configuration_study(
    Plan(
        name="case-7",
        title="Trajectory planning and tracking on ACROBOT",
        why=DIRECTIONS,
        cause=SOURCE,
        scenario="acrobot_pbvs",
        changes=(*SETUP, PULLEYS),
        configurations=(*PAIRS, *_simulated()),
        rendered=("none_tracking", "d2_tracking"),
        layouts=TRACKING_LAYOUTS,
    ),
    source="servoing thesis 4.3, figures 4.3 to 4.6",
    repetitions=15,
    assumptions=(
        "The tag is put where the printed desired poses put it, 0.04 m above the ground.",
        "Axes of rotations are in W for the platform and in P for the camera, and the turn leads "
        "from the belief to the truth: the printed assumed pose of d1 says so.",
        "Directions of the shifts of platform, camera and points are not printed, but for d1; each "
        "run draws its own from its seed.",
        f"The way is planned for {TIME:g} s; the thesis takes the time of the run without.",
        "Controller and camera run at 20 Hz, the printed time step of 0.05 s.",
        "Figure 4.3: elastic cables as in the robot's file, no pulleys, a projected camera.",
    ),
    checks=(_better, _same_without, _space, _accuracy, simulation),
)
