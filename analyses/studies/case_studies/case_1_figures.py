"""Figures 2.2 to 2.17 of the servoing thesis, in their layout."""

from __future__ import annotations

import numpy as np

from cdpr_drake.analyses.studies.framework.case_layouts import Layout, Panel, PanelLayout
from cdpr_drake.analyses.studies.framework.case_panels import (
    Draw,
    bars,
    corners_at,
    draw_estimate_angle,
    draw_estimate_distance,
    draw_estimated_paths,
    draw_image_deviation,
    draw_image_paths,
    draw_platform_from_above,
    draw_platform_paths,
    draw_positions,
    draw_velocities,
    metric,
    trace,
)

ALL = tuple("1234567")
BY_LENGTHS = tuple("4567")

REACHED = (10.0, 15.0)
"""When the plan of section 2.3.1 is at its second and third pose [s]."""

PICTURED = (0.0, *REACHED, 25.0)
"""Times of the images of figure 2.3 [s]."""

DEGREES = 180.0 / np.pi


def _names(prefix: str, keys: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(f"{prefix}_{key}" for key in keys)


def _off(of: tuple[str, ...], letter: str, times: tuple[float, ...] = ()) -> tuple[Panel, Panel]:
    """How far estimates are off, in place and in angle."""
    return (
        Panel(draw_estimate_distance, of, "error of the estimated position", letter, times=times),
        Panel(draw_estimate_angle, of, "error of the estimated rotation", letter, times=times),
    )


def _comparison(number: str, words: str, of: tuple[str, ...], platform: bool) -> PanelLayout:
    """Figures 2.4, 2.6, 2.8 and 2.10, the last without the path of the platform."""
    image = (
        Panel(draw_image_paths, of, "path of the tag's centre in the image", "a"),
        Panel(draw_image_deviation, of, "distance from its straight line", "b"),
    )
    path = Panel(draw_platform_paths, of, "path of the platform in W", "c", space=True)
    below = (path, *_off(of, "d")) if platform else _off(of, "c")
    return PanelLayout(f"Figure {number}: {words}, first run by each estimator", (image, below))


def _quality(number: str, words: str, of: tuple[str, ...]) -> PanelLayout:
    """Figures 2.5, 2.7, 2.9 and 2.11."""
    return PanelLayout(
        f"Figure {number}: {words}, mean and range over the runs",
        (
            (
                Panel(
                    bars(
                        "distance in the image [px]",
                        {"largest": metric("image_max_px"), "mean": metric("image_mean_px")},
                    ),
                    of,
                    "tag's centre from its straight line",
                    "a",
                ),
            ),
            (
                Panel(_spread("estimate_distance", "error [mm]", 1e3), of, "position", "b"),
                Panel(_spread("estimate_angle", "error [deg]", DEGREES), of, "rotation", "b"),
            ),
        ),
    )


def _spread(name: str, label: str, factor: float) -> Draw:
    return bars(
        label, {"largest": trace(name, np.max, factor), "mean": trace(name, np.mean, factor)}
    )


_OPEN = _names("o", ALL)
_ACROBOT = (*_names("a", ALL), "a_m")
_MOVING = _names("m", ("1", *BY_LENGTHS))

CASE_1_LAYOUTS: dict[str, Layout] = {
    "figure_2_2": PanelLayout(
        "Figure 2.2: without servoing, estimates beside the measured path",
        (
            (Panel(draw_estimated_paths, _OPEN, "path of the platform", "a", space=True),),
            _off(_OPEN, "b", REACHED),
        ),
    ),
    "figure_2_3": PanelLayout(
        "Figure 2.3: outline of the tag in the image, without servoing",
        tuple(
            tuple(
                Panel(corners_at(time), ("o_1",), f"t = {time:g} s", letter) for time, letter in row
            )
            for row in (
                tuple(zip(PICTURED[:2], "ab", strict=True)),
                tuple(zip(PICTURED[2:], "cd", strict=True)),
            )
        ),
    ),
    "figure_2_4": _comparison("2.4", "ACROBOT, static object", _ACROBOT, True),
    "figure_2_5": _quality("2.5", "ACROBOT, static object", _ACROBOT),
    "figure_2_6": _comparison("2.6", "ACROBOT, first pose wrong", _names("ap", ALL), True),
    "figure_2_7": _quality("2.7", "ACROBOT, first pose wrong", _names("ap", ALL)),
    "figure_2_8": _comparison("2.8", "CAROCA, static object", _names("c", ALL), True),
    "figure_2_9": _quality("2.9", "CAROCA, static object", _names("c", ALL)),
    "figure_2_10": _comparison("2.10", "CAROCA, first pose wrong", _names("cp", ALL), False),
    "figure_2_11": _quality("2.11", "CAROCA, first pose wrong", _names("cp", ALL)),
    "figure_2_12": PanelLayout(
        "Figure 2.12: CAROCA, first pose wrong, Est. 7",
        (
            (
                Panel(draw_positions, ("cp_7",), "estimated and measured position", "a"),
                Panel(draw_velocities, ("cp_7",), "cable velocities", "b"),
            ),
        ),
    ),
    "figure_2_16": PanelLayout(
        "Figure 2.16: behind a moving object",
        (
            (
                Panel(draw_platform_paths, _MOVING, "path of the platform", "a", space=True),
                Panel(draw_platform_from_above, _MOVING, "path from above", "b"),
            ),
            _off(_MOVING, "c"),
        ),
    ),
    "figure_2_17": PanelLayout(
        "Figure 2.17: behind a moving object, estimated and measured position",
        tuple(
            tuple(Panel(draw_positions, (f"m_{key}",), letter=letter) for key, letter in row)
            for row in ((("4", "a"), ("5", "b")), (("6", "c"), ("7", "d")), (("1", "e"),))
        ),
        height=0.8,
    ),
}
"""By the name of the file."""
