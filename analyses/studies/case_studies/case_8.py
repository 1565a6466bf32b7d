"""Case study VIII: planning and tracking the path of the features, on CAROCA."""

from __future__ import annotations

import numpy as np

from cdpr_drake.analyses.studies.case_studies.case_4 import ASSUMPTIONS, CAROCA_SERVO
from cdpr_drake.analyses.studies.case_studies.case_5 import HYBRID
from cdpr_drake.analyses.studies.case_studies.path_figures import CAROCA_LAYOUTS
from cdpr_drake.analyses.studies.framework.caroca_cables import CAROCA_RUN
from cdpr_drake.analyses.studies.framework.case_definition import Configuration, Plan
from cdpr_drake.analyses.studies.framework.case_run import converged
from cdpr_drake.analyses.studies.framework.case_study import configuration_study
from cdpr_drake.analyses.studies.framework.runs import Run, Runs
from cdpr_drake.analyses.studies.framework.statement import HARDWARE, SOURCE, Finding, statement

PRINTED_FACTOR = 2.0
"""Distances within this factor of the printed ones agree with them."""

PLANNED = (
    "The planned path is straight by construction; what can fail is how well the robot follows it."
)


@statement(
    "With tracking, the path in the image is straight to 5 px, more than 5 times better.",
    "figure 4.7b",
    cause=HARDWARE,
)
def _image(runs: Runs) -> Finding:
    servo, tracking = (
        runs.mean("image_max_px", configuration=name) for name in ("servo", "tracking")
    )
    return Finding(
        found=f"{tracking:.1f} px, without {servo:.1f} px",
        held=[tracking < 5.0, servo > 5.0 * tracking],
        some=tracking < 5.0,
        why="The largest values come close to the object, where the platform swings by "
        "millimetres: with this gain the loop is at its limit, and the "
        "thesis tells of an error that oscillates. What noise, pulleys and damping contribute is "
        "told in docs/theory/reproduction.md; the prototype's damping is not known. Means: "
        f"{runs.mean('image_mean_px', configuration='tracking'):.1f} px, without "
        f"{runs.mean('image_mean_px', configuration='servo'):.1f} px. " + PLANNED,
    )


@statement(
    "With tracking, the camera stays within 1.5 cm of its line of 2.3 m, 4 times better.",
    "figure 4.7d",
    cause=HARDWARE,
)
def _camera(runs: Runs) -> Finding:
    servo, tracking = (
        1e3 * runs.mean("camera_max_m", configuration=name) for name in ("servo", "tracking")
    )
    return Finding(
        found=f"{tracking:.1f} mm, without {servo:.1f} mm",
        held=[tracking < 15.0, servo > 4.0 * tracking],
        some=tracking < 15.0,
        why=PLANNED,
    )


@statement(
    "With tracking the camera is 7.1 mm from its line in the mean, with a standard deviation "
    "of 3.4 mm.",
    "7.1 and 3.4 mm",
    cause=HARDWARE,
)
def mean_distance(runs: Runs) -> Finding:
    """Section 4.5."""
    away = [1e3 * run["camera_deviation"] for run in runs(configuration="tracking")]
    means, spreads = [float(np.mean(d)) for d in away], [float(np.std(d)) for d in away]
    mean, spread = float(np.mean(means)), float(np.mean(spreads))
    close = [
        one <= PRINTED_FACTOR * printed
        for one, printed in zip((mean, spread), (7.1, 3.4), strict=True)
    ]
    return Finding(
        found=f"{mean:.1f} and {spread:.1f} mm; means of the runs {min(means):.1f} to "
        f"{max(means):.1f}",
        held=[all(close), mean >= 7.1 / PRINTED_FACTOR],
        some=close[0],
        why=f"Confirmed within a factor {PRINTED_FACTOR:g}; in part: a mean not above it. Over the "
        "rows of the log, equally spaced in time. " + PLANNED,
    )


TRACKED, STEP = 28.0, 0.05
"""Time of the trajectory and between steps of the controller. Source: section 4.4.1 [s]."""

TRACKING = (
    f"trajectory={{duration: {TRACKED:g}}}",
    "controller.lambda_0=1.7",
    "controller.lambda_infinity=1.7",
    "controller.rate=20",
    "camera.rate=20",
)

FILTERS = {"0.1": "filtered_100", "0.2": "filtered_200", "0.4": "filtered_400"}
"""Names of configurations by the filter's time constant [s], which is not printed."""

SMOOTHER = 0.8
"""A control output is smoother that is at most so rough as without filter."""


def roughness(run: Run) -> float:
    """Root mean square of the change of cable velocities from one step of 0.05 s to the next, over
    the time in which the path is tracked [m/s]."""
    times = np.arange(0.0, min(TRACKED, float(run["time"][-1])), STEP)
    rows = np.searchsorted(run["time"], times - 1e-9)
    return float(np.sqrt(np.mean(np.diff(run["cable_velocities"][rows], axis=0) ** 2)))


@statement(
    "A smoothing filter on the error makes the control output of CAROCA smoother.",
    "section 4.4.2, proposed, not done",
    rule=f"Smoother: by {100.0 * (1.0 - SMOOTHER):.0f} % at least, and the task ends",
    cause=SOURCE,
)
def filter_smooths(runs: Runs) -> Finding:
    """What section 4.4.2 proposes, and does not do."""
    plain = [1e3 * roughness(run) for run in runs(configuration="tracking")]
    found, paths, ended = {}, {}, True
    for constant, name in FILTERS.items():
        found[constant] = float(np.mean([1e3 * roughness(run) for run in runs(configuration=name)]))
        paths[constant] = 1e3 * runs.mean("camera_max_m", configuration=name)
        ended = ended and converged(runs, name)
    before = float(np.mean(plain))
    smoother = [value <= SMOOTHER * before for value in found.values()]
    return Finding(
        found=f"cable velocities change by {before:.2f} mm/s from step to step (rms), filtered by "
        + ", ".join(f"{constant} s {value:.2f}" for constant, value in found.items())
        + f" mm/s; camera {1e3 * runs.mean('camera_max_m', configuration='tracking'):.1f} mm "
        "from its line, "
        "filtered " + ", ".join(f"{value:.1f}" for value in paths.values()) + " mm",
        held=[*smoother, ended],
        some=any(smoother),
        why="First-order filter of the error of the features; its time constant is not printed, "
        "three are run.",
    )


STUDY = configuration_study(
    Plan(
        name="case-8",
        why="how the prototype's swing is damped is not known, see docs/theory/reproduction.md",
        cause=HARDWARE,
        title="Trajectory planning and tracking on CAROCA",
        scenario="caroca_pbvs",
        changes=(*CAROCA_SERVO, *HYBRID, *CAROCA_RUN),
        configurations=(
            Configuration("servo", "2 1/2 D", published={"camera_max_m": "below 70"}),
            Configuration(
                "tracking",
                "tracking",
                TRACKING,
                published={"image_max_px": "below 5", "camera_max_m": "at most 15"},
            ),
            *(
                Configuration(
                    name,
                    f"tracking, filter {constant} s",
                    (*TRACKING, f"controller.smoothing={constant}"),
                )
                for constant, name in FILTERS.items()
            ),
        ),
        rendered=("tracking",),
        layouts=CAROCA_LAYOUTS,
    ),
    source="servoing thesis 4.4, figures 4.7 and 4.8",
    assumptions=ASSUMPTIONS,
    checks=(_image, _camera, mean_distance, filter_smooths),
)
