"""Studies: cases VII and VIII of the servoing thesis, a planned path of the features, tracked."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cdpr_drake.analyses.studies.caroca_cases import COMMON, HYBRID, RAISED
from cdpr_drake.analyses.studies.caroca_cases import SERVO as CAROCA_SERVO
from cdpr_drake.analyses.studies.experiments import SETS, SETUP, TIME, TRACKING
from cdpr_drake.analyses.studies.servo import PULLEYS, Configuration, servo_study
from cdpr_drake.analyses.studies.servo_figures import (
    Panel,
    components,
    largest_and_mean,
    layout,
    paths_layout,
)
from cdpr_drake.arrays import Array

Curves = Mapping[str, Array]


def pairs() -> tuple[Configuration, ...]:
    """Without and with tracking, under each set of perturbations."""
    labels = {name: "no perturbation" if name == "none" else name for name in SETS}
    return tuple(
        Configuration(f"{name}_{kind}", f"{labels[name]}, {words}", (*changes, *more))
        for name, changes in SETS.items()
        for kind, words, more in (("servo", "2 1/2 D", ()), ("tracking", "tracking", TRACKING))
    )


def without_pulleys() -> tuple[Configuration, ...]:
    """As the simulation of the thesis, which has no pulleys."""
    return tuple(
        Configuration(
            f"simulated_{one.name}",
            f"{one.label}, no pulleys",
            (*one.changes, "cables.pulleys=false"),
            "simulated",
        )
        for one in pairs()
        if one.name.startswith(("none", "d2"))
    )


def names_of(*sets: str, prefix: str = "") -> tuple[str, ...]:
    """Names of configurations without and with tracking, set by set."""
    return tuple(f"{prefix}{name}_{kind}" for name in sets for kind in ("servo", "tracking"))


TRACKED, STEP = 28.0, 0.05
"""Time of CAROCA's trajectory, and between steps of the controller, section 4.4.1 [s]."""

CAROCA_TRACKING = (
    f"trajectory={{duration: {TRACKED:g}}}", "controller.lambda_0=1.7",
    "controller.lambda_infinity=1.7", "controller.rate=20", "camera.rate=20",
)  # fmt: skip

FILTERS = {"0.1": "filtered_100", "0.2": "filtered_200", "0.4": "filtered_400"}
"""Names of configurations by the filter's time constant [s], which is not printed."""


def roughness(curves: Curves) -> float:
    """Root mean square change of cable velocities from step to step, while tracking [m/s]."""
    times = np.arange(0.0, min(TRACKED, float(curves["time"][-1])), STEP)
    rows = np.searchsorted(curves["time"], times - 1e-9)
    return float(np.sqrt(np.mean(np.diff(curves["cable_velocities"][rows], axis=0) ** 2)))


def tracking_numbers(curves: Curves) -> dict[str, float]:
    """Roughness, and the distance of the camera from its line over equal times."""
    deviation = curves["camera_deviation"]
    return {
        "roughness_m_s": roughness(curves), "camera_even_mean_m": float(np.mean(deviation)),
        "camera_even_spread_m": float(np.std(deviation)),
    }  # fmt: skip


STUDIES = {
    "case-7": servo_study(
        name="case-7",
        title="Trajectory planning and tracking on ACROBOT",
        source="servoing thesis 4.3, figures 4.3 to 4.6",
        scenario="acrobot_pbvs",
        changes=(*SETUP, PULLEYS),
        configurations=(*pairs(), *without_pulleys()),
        rendered=("none_tracking", "d2_tracking"),
        repetitions=15,
        assumptions=(
            "The tag is put where the printed desired poses put it, 0.04 m above the ground.",
            "Axes of rotations are in W for the platform and in P for the camera, and the turn "
            "leads from the belief to the truth: the printed assumed pose of d1 says so.",
            "Directions of the shifts of platform, camera and points are not printed, but for d1; "
            "each run draws its own from its seed.",
            f"The way is planned for {TIME:g} s; the thesis takes the time of the run without.",
            "Controller and camera run at 20 Hz, the printed time step of 0.05 s.",
            "Figure 4.3: elastic cables as in the robot's file, no pulleys, a projected camera.",
        ),
        figures={
            "figure_4_3": paths_layout(
                "Figure 4.3: 2 1/2 D in simulation, with and without tracking",
                names_of("none", "d2", prefix="simulated_"),
            ),
            "figure_4_4": paths_layout(
                "Figure 4.4: 2 1/2 D on ACROBOT, no perturbation, d1 and d2",
                names_of("none", "d1", "d2"),
            ),
            "figure_4_5": paths_layout(
                "Figure 4.5: 2 1/2 D on ACROBOT, no perturbation, d3 and d4",
                names_of("none", "d3", "d4"),
            ),
            "figure_4_6": layout(
                "Figure 4.6: largest and mean distances from the straight lines, mean and range "
                "over runs",
                [
                    [
                        Panel(
                            largest_and_mean("distance [px]", "image", "px", letters=True),
                            names_of(*SETS),
                            "object's centre in the image",
                        ),
                        Panel(
                            largest_and_mean("distance [mm]", "camera", "m", 1e3, letters=True),
                            names_of(*SETS),
                            "camera in space",
                        ),
                    ]
                ],
                height=1.2,
            ),
        },
    ),
    "case-8": servo_study(
        name="case-8",
        title="Trajectory planning and tracking on CAROCA",
        source="servoing thesis 4.4, figures 4.7 and 4.8",
        scenario="caroca_pbvs",
        changes=(*CAROCA_SERVO[:-2], *HYBRID, *CAROCA_SERVO[-2:]),
        configurations=(
            Configuration("servo", "2 1/2 D"),
            Configuration("tracking", "tracking", CAROCA_TRACKING),
            *(
                Configuration(
                    name,
                    f"tracking, filter {constant} s",
                    (*CAROCA_TRACKING, f"controller.smoothing={constant}"),
                )
                for constant, name in FILTERS.items()
            ),
        ),
        rendered=("tracking",),
        metrics=tracking_numbers,
        columns=("roughness_m_s", "camera_even_mean_m", "camera_even_spread_m"),
        assumptions=(*RAISED, *COMMON),
        figures={
            "figure_4_7": paths_layout(
                "Figure 4.7: 2 1/2 D on CAROCA, with and without tracking", ("servo", "tracking")
            ),
            "figure_4_8": layout(
                "Figure 4.8: error e with tracking on CAROCA",
                [[Panel(components("error"), ("tracking",))]],
            ),
        },
    ),
}
