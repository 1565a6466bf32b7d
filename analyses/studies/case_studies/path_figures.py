"""Figures 3.28 to 3.44, 4.3 to 4.8 and A.14 to A.25 of the servoing thesis, in their layout."""

from __future__ import annotations

from collections.abc import Sequence

from cdpr_drake.analyses.studies.framework.case_layouts import (
    Layout,
    Panel,
    PanelLayout,
    each,
    paths_layout,
)
from cdpr_drake.analyses.studies.framework.case_panels import (
    bars,
    draw_corner_paths,
    draw_errors,
    draw_final_places,
    draw_platform_paths,
    draw_velocities,
    metric,
)


def three_layouts(first: int, robot: str) -> dict[str, Layout]:
    """Figures of three experiments, without perturbation, with one within and one beyond bounds:
    paths of the tag, errors, cable velocities, as 3.28 to 3.30 and 3.36 to 3.38.

    Args:
        first: Number in chapter 3 of the first of them.
        robot: For the titles.
    """
    of = ("none", "within", "beyond")
    return {
        f"figure_3_{first}": PanelLayout(
            f"Figure 3.{first}: {robot}, path of the tag in the image, its four corners",
            each(draw_corner_paths, of),
        ),
        f"figure_3_{first + 1}": PanelLayout(
            f"Figure 3.{first + 1}: {robot}, error e over time", each(draw_errors, of)
        ),
        f"figure_3_{first + 2}": PanelLayout(
            f"Figure 3.{first + 2}: {robot}, cable velocities over time", each(draw_velocities, of)
        ),
    }


def four_layouts(chapter: str, first: int, of: Sequence[str], words: str) -> dict[str, Layout]:
    """Figures of experiments E1, E2, ... on four points: paths in the image, errors, cable
    velocities, paths of the platform, as 3.41 to 3.44 and A.14 to A.25.

    Args:
        chapter: Of the figures.
        first: Number of the first of them.
        of: Names of the configurations.
        words: What is wrong, for the titles.
    """
    shown = tuple(of)
    said = (
        ("paths of the four points in the image", each(draw_corner_paths, shown, 2)),
        ("error e over time", each(draw_errors, shown, 2)),
        ("cable velocities over time", each(draw_velocities, shown, 2)),
        (
            "path of the platform",
            ((Panel(draw_platform_paths, shown, "in the world frame W", space=True),),),
        ),
    )
    return {
        f"figure_{chapter}_{first + k}": PanelLayout(
            f"Figure {chapter.upper()}.{first + k}: {words}, {about}", rows
        )
        for k, (about, rows) in enumerate(said)
    }


FINAL_POSES: dict[str, Layout] = {
    "figure_3_31": PanelLayout(
        "Figure 3.31: where the camera ends, from above",
        tuple(
            tuple(Panel(draw_final_places, (name,), words, letter) for name, words, letter in row)
            for row in (
                (
                    ("none", "PBVS, no perturbation added", "a"),
                    ("blind_none", "position control, no perturbation added", "b"),
                ),
                (
                    ("within", "PBVS, 0.1 m, 5 deg", "c"),
                    ("blind_within", "position control, 0.1 m, 5 deg", "d"),
                ),
            )
        ),
    ),
}
"""Of case study II."""


def turned_layouts(angles: dict[int, str]) -> dict[str, Layout]:
    """Figures 3.33 to 3.35: path in the image and error with the camera turned.

    Args:
        angles: Names of the configurations by the figure's number in chapter 3.
    """
    return {
        f"figure_3_{number}": PanelLayout(
            f"Figure 3.{number}: path of the tag in the image, its four corners, and error e",
            (
                (
                    Panel(draw_corner_paths, (name,), letter="a"),
                    Panel(draw_errors, (name,), letter="b"),
                ),
            ),
        )
        for number, name in angles.items()
    }


def pairs_of(*sets: str, prefix: str = "") -> tuple[str, ...]:
    """Names of the configurations of case VII without and with tracking, set by set."""
    return tuple(f"{prefix}{name}_{kind}" for name in sets for kind in ("servo", "tracking"))


_EVERY = pairs_of("none", "d1", "d2", "d3", "d4")

TRACKING_LAYOUTS: dict[str, Layout] = {
    "figure_4_3": paths_layout(
        "Figure 4.3: 2 1/2 D in simulation, with and without tracking",
        pairs_of("none", "d2", prefix="simulated_"),
    ),
    "figure_4_4": paths_layout(
        "Figure 4.4: 2 1/2 D on ACROBOT, no perturbation, d1 and d2", pairs_of("none", "d1", "d2")
    ),
    "figure_4_5": paths_layout(
        "Figure 4.5: 2 1/2 D on ACROBOT, no perturbation, d3 and d4", pairs_of("none", "d3", "d4")
    ),
    "figure_4_6": PanelLayout(
        "Figure 4.6: largest and mean distances from the straight lines, mean and range over runs",
        (
            (
                Panel(
                    bars(
                        "distance [px]",
                        {"largest": metric("image_max_px"), "mean": metric("image_mean_px")},
                        letters=True,
                    ),
                    _EVERY,
                    "object's centre in the image",
                ),
                Panel(
                    bars(
                        "distance [mm]",
                        {
                            "largest": metric("camera_max_m", 1e3),
                            "mean": metric("camera_mean_m", 1e3),
                        },
                        letters=True,
                    ),
                    _EVERY,
                    "camera in space",
                ),
            ),
        ),
        height=1.2,
    ),
}
"""Of case study VII."""

CAROCA_LAYOUTS: dict[str, Layout] = {
    "figure_4_7": paths_layout(
        "Figure 4.7: 2 1/2 D on CAROCA, with and without tracking", ("servo", "tracking")
    ),
    "figure_4_8": PanelLayout(
        "Figure 4.8: error e with tracking on CAROCA", ((Panel(draw_errors, ("tracking",)),),)
    ),
}
"""Of case study VIII."""

HYBRID_LAYOUTS: dict[str, Layout] = {
    "figure_3_39": paths_layout("Figure 3.39: 2 1/2 D on CAROCA", ("none", "within", "beyond")),
}
"""Of case study V."""
