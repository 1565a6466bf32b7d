"""Figures 5.11 to 5.18 and 5.24 to 5.26 of the servoing thesis, in their layout."""

from __future__ import annotations

import numpy as np

from cdpr_drake.analyses.studies.framework.case_layouts import (
    CableLayout,
    Layout,
    Panel,
    PanelLayout,
    paths_layout,
)
from cdpr_drake.analyses.studies.framework.case_panels import (
    bars,
    draw_image_deviation,
    draw_image_paths,
    draw_stable,
    draw_taut,
    last,
    trace,
)
from cdpr_drake.analyses.studies.tension_cases.slack_experiments import CORRECTED, PLAIN, SLACKS_CM

ALL = tuple(f"E{k}" for k in range(1, 11))

SHOWN = ("E1", "E2", "E5", "E6", "E9", "E10")
"""Of which the thesis shows curves by cable, section 5.3.1."""


def _by_cable(number: str, words: str, quantity: str, of: tuple[str, ...]) -> dict[str, Layout]:
    name = f"figure_{number.replace('.', '_')}"
    return {name: CableLayout(f"Figure {number}: {words}", quantity, of)}


def _ends(number: str) -> dict[str, Layout]:
    """How far the estimate is off at the end, figures 5.17 and 5.26."""
    return {
        f"figure_{number.replace('.', '_')}": PanelLayout(
            f"Figure {number}: error of the estimated pose at the end, mean and range over runs",
            (
                (
                    Panel(
                        bars("error [mm]", {"at the end": trace("estimate_distance", last, 1e3)}),
                        ALL,
                        "position",
                    ),
                    Panel(
                        bars(
                            "error [deg]",
                            {"at the end": trace("estimate_angle", last, 180.0 / np.pi)},
                        ),
                        ALL,
                        "rotation",
                    ),
                ),
            ),
        )
    }


CASE_9_LAYOUTS: dict[str, Layout] = {
    **_by_cable("5.11", "cable lengths", "cable_lengths", SHOWN),
    **_by_cable("5.12", "cable velocities", "velocities", SHOWN),
    **_by_cable("5.13", "cable tensions", "cable_tensions", SHOWN),
    "figure_5_16": PanelLayout(
        "Figure 5.16: path of the tag's centre in the image",
        (
            (
                Panel(draw_image_paths, ALL, "path", "a"),
                Panel(draw_image_deviation, ALL, "distance from the straight line", "b"),
            ),
        ),
    ),
    **_ends("5.17"),
    "figure_5_18": PanelLayout(
        "Figure 5.18: cables in tension, and whether the criterion of stability holds",
        tuple(
            (
                Panel(draw_taut, pair, f"{slack} cm of slack", letter),
                Panel(draw_stable, pair, f"{slack} cm of slack", letter),
            )
            for slack, letter, *pair_ in zip(SLACKS_CM, "abcde", PLAIN, CORRECTED, strict=True)
            for pair in (tuple(pair_),)
        ),
        height=0.55,
    ),
}
"""Of case study IX."""

CASE_10_LAYOUTS: dict[str, Layout] = {
    "figure_5_24": paths_layout("Figure 5.24: 2 1/2 D on CAROCA with slack cables", ALL),
    **_by_cable("5.25", "cable tensions", "cable_tensions", ALL),
    **_ends("5.26"),
}
"""Of case study X."""
