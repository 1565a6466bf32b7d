"""Studies: cases II and III of the servoing thesis, PBVS on ACROBOT, and with a turned camera."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from cdpr_drake.analyses.studies.experiments import DRAWN
from cdpr_drake.analyses.studies.servo import PULLEYS, Configuration, servo_study
from cdpr_drake.analyses.studies.servo_figures import (
    Panel,
    components,
    draw_corner_paths,
    draw_final_places,
    each,
    layout,
)
from cdpr_drake.arrays import Array

Curves = Mapping[str, Array]

COMMON = (
    "initial_pose={position: [0.097, -0.026, 0.323], angles_deg: [20, -20, 45]}",
    "target.size=0.04", "controller.lambda_0=1.7", "controller.lambda_infinity=0.2",
    "controller.lambda_slope=30", "stop.position=0.0005", "stop.rotation_deg=0.57", "duration=60",
)  # fmt: skip
"""The printed initial pose, gains and thresholds of both."""

WITHIN = "perturbations.initial_pose_shift={distance: 0.1, angle_deg: 5}"
BEYOND = "perturbations.initial_pose_shift={distance: 0.2, angle_deg: 10}"

BLIND = "open_loop={waypoints: [{pose: {position: [0.35, 0.28, 0.06]}, duration: 10}]}"
"""The controller of appendix A.4 on its way to the printed desired pose."""

BY_HAND = "perturbations.initial_pose_shift={distance: 0.02}"
"""The first pose was measured by hand, section 3.4.1."""

ZOOMS = {"0.01": "focus_1", "0.02": "focus_2", "0.05": "focus_5"}
"""Names of configurations by how far the auto-focus zooms in and out, which is not printed."""

OF = ("none", "within", "beyond")


def focus(zoom: str) -> tuple[str, str]:
    """An auto-focus that zooms by a share, each 2 s, which is chosen."""
    return f"camera.focus_zoom={zoom}", "camera.focus_period=2"


def case_2_configurations() -> tuple[Configuration, ...]:
    """Perturbations within and beyond bounds, without a camera, and what the prototype has."""
    existing = "existing perturbations"
    exact = ("perturbations.anchor_points=0", "cables.pulleys=false")
    return (
        Configuration("none", "no perturbation added"),
        Configuration("within", "0.1 m, 5 deg (within bounds)", (WITHIN,)),
        Configuration("beyond", "0.2 m, 10 deg (beyond bounds)", (BEYOND,)),
        Configuration("blind_none", "without camera", (BLIND,)),
        Configuration("blind_within", "without camera, 0.1 m, 5 deg", (BLIND, WITHIN)),
        Configuration("exact", "exact", exact, existing),
        Configuration("by_hand", "first pose by hand", (BY_HAND,), existing),
        *(
            Configuration(name, f"auto-focus {zoom}", focus(zoom), existing)
            for zoom, name in ZOOMS.items()
        ),
        Configuration("existing", "all of these", (BY_HAND, *focus("0.02")), existing),
    )


def turned(angle_deg: float, more: str = "") -> Configuration:
    """A camera turned about its optical axis, perhaps with a constant gain."""
    belief = f"perturbations.camera_pose={{position: [0, 0, 0], angles_deg: [0, 0, {angle_deg:g}]}}"
    if more:
        changes = (belief, "controller.lambda_infinity=1.7")
        return Configuration(f"turned_{angle_deg:g}_constant", f"turned by 85 deg, {more}", changes)
    return Configuration(f"turned_{angle_deg:g}", f"camera turned by {angle_deg:g} deg", (belief,))


def winding(curves: Curves) -> float:
    """How often the object's path in the image winds about its goal [turns]."""
    x, y = (curves["image_path"] - curves["image_line"][1]).T
    angles = np.unwrap(np.arctan2(y, x))
    return float(abs(angles[-1] - angles[0]) / (2.0 * np.pi))


def radius(curves: Curves, end: bool) -> float:
    """Distance of the object from its goal in the image, the least or that at the end [px]."""
    away = np.linalg.norm(curves["image_path"] - curves["image_line"][1], axis=1)
    return float(away[-1] if end else away.min())


def overshoot(curves: Curves) -> float:
    """How far the errors of x and y go beyond zero, over the norm of the first ones [-].

    Rows of NaN, in which the object was not seen, do not count.
    """
    error = curves["error"][:, 3:5]
    seen = error[np.isfinite(error[:, 0])]
    beyond = np.maximum(-np.sign(seen[0]) * seen, 0.0)
    return float(np.max(beyond) / np.linalg.norm(seen[0]))


def turned_numbers(curves: Curves) -> dict[str, float]:
    """Columns of case III, beside those of every servo."""
    return {
        "winding_turns": winding(curves), "radius_least_px": radius(curves, end=False),
        "radius_end_px": radius(curves, end=True), "overshoot": overshoot(curves),
    }  # fmt: skip


def experiment_figures(first: int, robot: str, of: tuple[str, ...] = OF) -> dict[str, Any]:
    """Paths of the tag, errors and cable velocities, as figures 3.28 to 3.30 and 3.36 to 3.38."""
    panels = (
        ("path of the tag in the image, its four corners", draw_corner_paths),
        ("error e over time", components("error")),
        ("cable velocities over time", components("cable_velocities", 1e3)),
    )
    return {
        f"figure_3_{first + k}": layout(f"Figure 3.{first + k}: {robot}, {words}", each(draw, of))
        for k, (words, draw) in enumerate(panels)
    }


FINAL_PLACES = layout(
    "Figure 3.31: where the camera ends, from above",
    [
        [
            Panel(draw_final_places, ("none",), "PBVS, no perturbation added", "a"),
            Panel(draw_final_places, ("blind_none",), "position control, no perturbation", "b"),
        ],
        [
            Panel(draw_final_places, ("within",), "PBVS, 0.1 m, 5 deg", "c"),
            Panel(draw_final_places, ("blind_within",), "position control, 0.1 m, 5 deg", "d"),
        ],
    ],
)

STUDIES = {
    "case-2": servo_study(
        name="case-2",
        title="PBVS on ACROBOT",
        source="servoing thesis 3.4.1, figures 3.28 to 3.31",
        scenario="acrobot_pbvs",
        changes=(
            COMMON[0],
            "desired={position: [0, 0, 0.07], angles_deg: [180, 0, 180]}",
            "target.pose={position: [0.2869, 0.28, 0]}",
            *COMMON[1:],
            "perturbations.anchor_points=0.005",  # on spheres of 0.01 m diameter
            PULLEYS,
        ),
        configurations=case_2_configurations(),
        rendered=("none",),
        assumptions=(
            "The tag lies on the ground below the printed desired pose; its size is 0.04 m, so "
            "that it is seen at both poses. Camera: the industrial one; with the webcam's field "
            "of view the tag would not be seen at the printed initial pose.",
            DRAWN,
            "Of the perturbations of the prototype, all simulations but one have those of the "
            "anchor points and of the pulleys; those of the first pose and of the auto-focus are "
            "in runs of their own.",
        ),
        figures=experiment_figures(28, "ACROBOT") | {"figure_3_31": FINAL_PLACES},
    ),
    "case-3": servo_study(
        name="case-3",
        title="PBVS on ACROBOT with a turned camera",
        source="servoing thesis 3.4.2, figures 3.32 to 3.35",
        scenario="acrobot_pbvs",
        changes=(
            COMMON[0],
            "desired={position: [0, 0, 0.09], angles_deg: [180, 0, 180]}",
            "target.pose={position: [0.164, 0.066, 0]}",
            *COMMON[1:-1],
            "camera.latency_frames=1",
            COMMON[-1],
        ),
        configurations=(
            Configuration("none", "no perturbation"),
            turned(16.0),
            turned(55.0),
            turned(85.0),
            turned(85.0, "constant gain"),
        ),
        rendered=("turned_16",),
        metrics=turned_numbers,
        columns=("winding_turns", "radius_least_px", "radius_end_px", "overshoot"),
        assumptions=(
            "The desired state is lost in the text. The tag lies on the ground where the printed "
            "initial poses of platform and object put it; it is wanted 0.09 m below the camera, "
            "as in section 2.3.2.",
            "The controller believes the camera to be turned about its optical axis.",
            "An image reaches the controller after one more image period (0.04 s); the thesis "
            "gives no delay.",
            "Size of the tag: 0.04 m. Camera: the industrial one, in place of the webcam.",
        ),
        figures={
            f"figure_3_{number}": layout(
                f"Figure 3.{number}: path of the tag in the image, its four corners, and error e",
                [
                    [
                        Panel(draw_corner_paths, (name,), letter="a"),
                        Panel(components("error"), (name,), letter="b"),
                    ]
                ],
            )
            for number, name in {33: "turned_85", 34: "turned_55", 35: "turned_16"}.items()
        },
    ),
}
