"""Study: shapes of the servoing thesis' control stability workspaces, drawn as the thesis does.

What the thesis says of a shape is judged by numbers of it: heights, planes, distances.

Source: servoing thesis 3.3, 3.4.2 and 4.3.1, figures 3.8, 3.10, 3.13, 3.15, 3.17, 3.20, 3.22, 3.25,
3.27, 3.32, 4.2.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cdpr_drake.analyses.frame.figures import bare_figure, new_figure
from cdpr_drake.analyses.studies.rows import Row
from cdpr_drake.analyses.studies.stability_recipe import (
    RECIPE,
    SampledTask,
    recipe_bounds,
    recipe_case,
    recipe_grid,
    recipe_options,
)
from cdpr_drake.analyses.studies.stability_tables import BASELINE_VALUES, BY_NAME
from cdpr_drake.analyses.studies.study import Case, Form, Frame, Study
from cdpr_drake.analyses.visualization.solids import draw_solid
from cdpr_drake.analyses.workspaces.servo_stability import PRINTED
from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.palette import DESIRED, IDEAL, PLATFORM, WORKSPACES, nth_look
from cdpr_drake.stability.desired_view import OppositeCorner, ServoTarget
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
from cdpr_drake.workspaces.volume import VolumeRule, surface_quads, workspace_volume

BASELINE = "baseline"
"""Panel of a workspace under the baseline bounds."""

NESTED: dict[str, tuple[float, ...]] = {
    "r_bp": (0.05, 0.1), "r_A": (0.03, 0.06), "r_B": (0.03, 0.06), "r_pc": (0.2,),
    "d_theta_bp_deg": (20.0, 30.0), "d_theta_pc_deg": (30.0, 50.0), "r_s": (0.5,),
}  # fmt: skip
"""Planar robot: rows of table A.8 that are drawn over the baseline, a panel for each bound. Which
ones figure 3.8 shows the text says of r_bp=0.1 and r_pc=0.2 alone."""

COLUMNS = 4
"""Panels side by side."""

LEAST_WIDTH = 8.6
"""Of a figure of solids, so that its legend fits [inch]."""

PANELS: dict[str, tuple[str, tuple[tuple[str, float], ...]]] = {
    "3.13": ("A.10", (("r_bp", 0.1), ("r_bp", 0.5), ("d_theta_bp_deg", 10.0),
                      ("d_theta_bp_deg", 30.0), ("r_B", 0.03), ("r_A", 0.1))),
    "3.15": ("A.12", (("r_bp", 0.3), ("r_bp", 1.0), ("d_theta_bp_deg", 10.0),
                      ("d_theta_pc_deg", 20.0), ("r_B", 0.1), ("r_A", 0.1))),
    "3.17": ("A.11", (("r_bp", 0.1), ("r_bp", 0.25), ("d_theta_bp_deg", 20.0),
                      ("d_theta_pc_deg", 50.0), ("r_A", 0.05))),
    "3.20": ("A.14", (("r_bp", 0.1), ("r_bp", 0.5), ("d_theta_bp_deg", 10.0),
                      ("d_theta_bp_deg", 20.0), ("d_theta_bp_deg", 30.0), ("r_B", 0.02),
                      ("r_A", 0.1))),
    "3.22": ("A.15", (("r_bp", 1.0), ("d_theta_bp_deg", 20.0), ("r_pc", 0.3), ("r_B", 0.4),
                      ("r_A", 0.2))),
    "3.25": ("A.17", (("r_bp", 0.1), ("r_bp", 0.5), ("d_theta_bp_deg", 30.0), ("r_B", 0.03),
                      ("r_A", 0.1))),
    "3.27": ("A.18", (("r_bp", 1.0), ("d_theta_bp_deg", 50.0), ("d_theta_pc_deg", 50.0),
                      ("r_B", 0.4), ("r_A", 0.4))),
    "3.8": ("A.8", tuple((bound, value) for bound, values in NESTED.items() for value in values)),
}  # fmt: skip
"""By the thesis' figure: table of its numbers, and rows that are drawn beside the baseline. Rows of
which the text names the panel are among them; which the others are, the text does not say."""

SINGLE_VOLUME = (0.514, 1.014)
"""Printed volume with the camera turned by 55 deg alone, and the full one [m^3]."""

SINGLE_PLACES = np.array([[0.097, -0.026, 0.323], [0.164, 0.066, 0.1]])
"""Where the platform of section 3.4.2 starts; where it ends is lost in the text: above the tag."""

COMBINATIONS = {
    "Cb. 2": PerturbationBounds(r_s=0.5, r_pc=0.3, d_theta_pc=math.radians(6.0)),
    "Cb. 13": PerturbationBounds(r_s=0.3, r_pc=0.2, d_theta_pc=math.radians(61.0)),
}
"""Combinations of section 3.2.1 whose numbers are printed, of its analysis II. Figure 3.10 shows
number 2 and 16 of analysis III, whose numbers are not."""

SETS = {
    "D1": PerturbationBounds(r_bp=0.19, d_theta_bp=math.radians(8.4), d_theta_pc=math.radians(18)),
    "D2": PerturbationBounds(
        r_bp=0.13, d_theta_bp=math.radians(9.5), r_pc=0.05, d_theta_pc=math.radians(12.5),
        r_A=0.005, r_B=0.005,
    ),
    "D3": PerturbationBounds(
        r_bp=0.075, d_theta_bp=math.radians(8), r_pc=0.05, d_theta_pc=math.radians(18), r_A=0.01,
        r_B=0.01,
    ),
    "D4": PerturbationBounds(r_bp=0.11, d_theta_bp=math.radians(6), d_theta_pc=math.radians(15)),
}  # fmt: skip
"""The least bounds that hold the printed sets d1 to d4; figure 4.2's own are not printed."""

UNTURNED = np.zeros((1, 3))

TURN = math.radians(30.0)
"""Servoing thesis 4.3.1: the platform may be turned so far about any axis [rad]."""

TURNS = np.vstack([UNTURNED, TURN * np.eye(3), -TURN * np.eye(3)])

TURNED_PLACES = np.array([[0.107, -0.026, 0.35], [0.30, 0.25, 0.12]])
"""Start and goal of the platform in section 4.3.1 [m]."""

POSES = 2000
"""Poses that are judged at once."""

ASSUMPTIONS = (
    "Perturbations as in the study control-stability, see its recipe; by samples alone.",
    "Figure 4.2: the bounds D1 to D4 are not printed; here the least that hold the printed sets "
    "d1 to d4, points of the cables each in a direction of its own. A position must be stable "
    "unturned and turned by +-30 deg about x, y and z.",
    "Figure 3.10: its combinations 2 and 16 are not printed; here 2 and 13 of analysis II.",
)


def cases(form: Form) -> Iterator[Case]:
    """All workspaces, figure by figure; in the quick form on coarse grids."""
    for figure, (table, rows) in PANELS.items():
        for bound, value in (("r_bp", BASELINE_VALUES["r_bp"]), *rows):
            yield table_case(form, figure, table, bound, value)
    for name, bounds in COMBINATIONS.items():
        yield shape_case(form, "3.10", name, "planar", "pbvs", bounds)
    for name, bounds in SETS.items():
        yield shape_case(
            form, "4.2", name, "acrobot_small", "2.5d", bounds, angles=TURNS, places=TURNED_PLACES
        )
    # Without the turns, as in figure 3.20a, but of the platform of case VII.
    yield table_case(form, "4.2", "A.13", "r_bp", BASELINE_VALUES["r_bp"])
    whole = recipe_grid("acrobot_small")
    yield shape_case(
        form, "3.32", "d_theta_pc=55 deg alone", "acrobot_small", "pbvs",
        PerturbationBounds(d_theta_pc=math.radians(55.0)),
        printed=round(100.0 * SINGLE_VOLUME[0] / SINGLE_VOLUME[1], 1),
        target=OppositeCorner(whole.lower, whole.upper), places=SINGLE_PLACES,
    )  # fmt: skip


def table_case(form: Form, figure: str, table: str, bound: str, value: float) -> Case:
    """A row of a table as a panel of a figure."""
    rows = BY_NAME[table]
    words = f"{bound.removesuffix('_deg')}={value:g}" + (" deg" if bound.endswith("_deg") else "")
    first = (bound, value) == ("r_bp", BASELINE_VALUES["r_bp"])
    return shape_case(
        form, figure, BASELINE if first else words, rows.robot, rows.scheme,
        recipe_bounds(rows, bound, value), printed=rows.rows[bound][value],
    )  # fmt: skip


def shape_case(
    form: Form, figure: str, panel: str, robot: str, scheme: str, bounds: PerturbationBounds, *,
    angles: Array = UNTURNED, printed: float | None = None, target: ServoTarget | None = None,
    places: Array | None = None,
) -> Case:  # fmt: skip
    """A workspace to compute.

    Args:
        form: Of the study.
        figure: The thesis' number of the figure.
        panel: Name of the panel, such as `r_bp=0.5`; once in a figure.
        robot: Name of the robot.
        scheme: Of visual servoing.
        bounds: What limits the perturbations.
        angles: Orientations in all of which a position must be stable, shape (k, 3) [rad].
        printed: Published share of the full workspace [%].
        target: What is servoed to; None: the target of the recipe.
        places: Start and goal of the platform, shape (2, 3) [m], if they are printed.
    """
    case = recipe_case(robot, scheme)
    if target is not None:  # with it goes the camera's place of section 3.4.2, see there
        case = StabilityCase(case.cables, scheme, target=target, lever=PRINTED)
    grid = WorkspaceGrid(recipe_grid(robot, form.quick).axes, angles)
    return Case(
        keys={
            "figure": figure, "panel": panel, "robot": robot, "scheme": scheme,
            "grid": "coarse" if form.quick else "full", "printed_percent": printed,
        },
        call=partial(shape, SampledTask(case, bounds, grid, recipe_options(robot)), places),
    )  # fmt: skip


def shape(task: SampledTask, places: Array | None) -> dict[str, Any]:
    """A workspace by the verdicts on its poses, see `shape_row`."""
    grid = task.grid
    parts = [task(k, min(k + POSES, grid.size))["stable"] for k in range(0, grid.size, POSES)]
    inside = np.all(np.concatenate(parts).reshape(grid.shape), axis=0)
    row = shape_row(inside, grid.axes, places)
    return {**row, "bounds": task.bounds.as_dict(), "orientations_rad": grid.angles.tolist()}


def shape_row(
    inside: np.ndarray, axes: tuple[Array, Array, Array], places: Array | None = None
) -> dict[str, Any]:
    """Numbers of a workspace.

    Args:
        inside: Positions of a grid that are stable in all orientations, shape (nx, ny, nz).
        axes: Of the grid [m].
        places: Start and goal of the platform, shape (2, 3) [m], or None.

    Returns:
        share_percent: of the whole box; positions_inside of positions; planes: share of each plane
        of equal height, upwards; lowest_plane, the first; narrows: true if no plane holds more than
        the one below it, and the last one less than half of the first; top_m: highest plane with a
        position inside above the lowest of the grid; corners_remain: true if all corners of that
        one are inside; mean_height_m, mean_from_yz_m, mean_from_xz_m: mean height and distances
        from the planes of W; far_m: largest coordinate; start_inside, goal_inside: of places, by
        the nearest position; inside, x_m, y_m, z_m, places_m: as the arguments.
    """
    full = workspace_volume(np.ones_like(inside), axes, VolumeRule.CORNERS).value
    planes = np.mean(inside, axis=(0, 1))
    held = np.flatnonzero(planes)
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1)[inside]
    from_yz, from_xz, _ = np.mean(np.abs(points), axis=0) if len(points) else np.full(3, np.nan)
    row = {
        "share_percent": 100.0 * workspace_volume(inside, axes, VolumeRule.CORNERS).value / full,
        "positions_inside": int(np.sum(inside)),
        "positions": inside.size,
        "planes": planes.tolist(),
        "lowest_plane": float(planes[0]),
        "narrows": narrows(planes[held]),
        "top_m": float(axes[2][held[-1]] - axes[2][0]) if len(held) else -math.inf,
        "corners_remain": bool(np.all(inside[[0, 0, -1, -1], [0, -1, 0, -1], 0])),
        "mean_height_m": float(np.mean(points[:, 2])) if len(points) else math.nan,
        "mean_from_yz_m": float(from_yz),
        "mean_from_xz_m": float(from_xz),
        "far_m": float(np.max(np.abs(points))) if len(points) else math.nan,
        "inside": inside,
        **dict(zip(("x_m", "y_m", "z_m"), axes, strict=True)),
        "places_m": None if places is None else places.tolist(),
    }
    if places is not None:
        row["start_inside"], row["goal_inside"] = (holds(inside, axes, place) for place in places)
    return row


def holds(inside: np.ndarray, axes: tuple[Array, Array, Array], place: Array) -> bool:
    """True if the grid's position nearest to a place, shape (3,) [m], is inside."""
    nearest = [int(np.argmin(np.abs(axis - x))) for axis, x in zip(axes, place, strict=True)]
    return bool(inside[tuple(nearest)])


def narrows(planes: Array) -> bool:
    """True if shares of planes upwards fall, to less than half."""
    falling = bool(np.all(np.diff(planes) <= 0.0))
    return len(planes) > 1 and falling and bool(planes[-1] < 0.5 * planes[0])


def share_table(rows: Frame) -> Frame:
    """Shares of the box, beside the published ones [%]."""
    names = ["figure", "robot", "scheme", "panel", "printed_percent", "share_percent"]
    return rows[names].round(1)


def panels_of(rows: Frame, number: str) -> list[dict[str, Any]]:
    """The workspaces of one of the thesis' figures."""
    return rows[rows["figure"] == number].to_dict("records")


def axes_of(row: Row) -> tuple[Any, Any, Any]:
    """Coordinates of the grid along x, y and z, shape (n,) each [m]."""
    return row["arrays"]["x_m"], row["arrays"]["y_m"], row["arrays"]["z_m"]


def published(row: Row, words: str) -> str:
    """A printed share in words, if there is one."""
    return "" if np.isnan(row["printed_percent"]) else words.format(row["printed_percent"])


def solids_figure(rows: Frame, number: str) -> Figure:
    """The workspaces of one of the thesis' figures."""
    panels = panels_of(rows, number)
    robot = load_robot(panels[0]["robot"])
    columns = min(COLUMNS, len(panels))
    lines = -(-len(panels) // columns)
    figure = bare_figure(
        (max(4.3 * columns, LEAST_WIDTH), 1.3 + 4.1 * lines),
        f"Control stability workspaces, {panels[0]['scheme']} on {panels[0]['robot']}, "
        f"as figure {number} of the servoing thesis",
    )
    handles: list[Line2D] = []
    for place, row in enumerate(panels, start=1):
        axes = figure.add_subplot(lines, columns, place, projection="3d", computed_zorder=False)
        handles += draw_solid(
            axes, surface_quads(row["arrays"]["inside"], axes_of(row)), WORKSPACES["SZ"],
            (robot.frame.lower, robot.frame.upper), robot.cable_set().p_WA,
        )  # fmt: skip
        if row["places_m"] is not None:
            start, goal = row["places_m"]
            axes.plot(
                *np.transpose([start, goal]), color=IDEAL.color, linestyle=IDEAL.dash, zorder=5
            )
            handles += axes.plot(*start, "o", color=PLATFORM.color, zorder=6, label="start",
                                 markeredgecolor="white")  # fmt: skip
            handles += axes.plot(*goal, DESIRED.marker, color=DESIRED.color, markersize=9,
                                 markeredgecolor="white", zorder=6, label="goal")  # fmt: skip
        words = f"{row['share_percent']:.1f} %{published(row, ', published {:g} %')}"
        axes.set_title(f"{row['panel']}\n{words}", fontsize=10, y=1.0, pad=0)
    figure.legend(
        handles=list({one.get_label(): one for one in handles}.values()),
        loc="outside lower center", ncols=4, title_fontsize=9,
        title="by samples; solids are the cells between points of the grid with all corners inside",
    )  # fmt: skip
    return figure


def nested_figure(rows: Frame) -> Figure:
    """The planar robot's workspaces under one larger bound each, over the baseline."""
    panels = panels_of(rows, "3.8")
    base = [row for row in panels if row["panel"] == BASELINE]
    groups = {
        bound: [row for row in panels if row["panel"].partition("=")[0] == bound]
        for bound in (name.removesuffix("_deg") for name in NESTED)
    }
    groups = {bound: group for bound, group in groups.items() if group}
    lines = -(-max(len(groups), 1) // COLUMNS)
    figure, grid = new_figure(
        lines, COLUMNS, (4.0 * COLUMNS, 1.4 + 4.9 * lines),
        "Planar robot, PBVS: workspaces under one larger bound over that of the baseline, as "
        "figure 3.8 of the servoing thesis",
    )  # fmt: skip
    flat = list(np.ravel(grid))
    for letter, axes, (bound, group) in zip("abcdefgh", flat, groups.items(), strict=False):
        for k, row in enumerate([*base, *group]):
            look = nth_look(k)
            words = f"{row['panel']}: {row['share_percent']:.1f}{published(row, ' ({:g})')} %"
            draw_plane(
                axes, row, marker="so^"[k], markersize=(6.5, 4.5, 3.0)[k], label=words,
                color=("#b9cfe4", look.color, look.color)[k],
                markerfacecolor=("#b9cfe4", "white", look.color)[k],
            )  # fmt: skip
        axes.set_title(f"({letter}) {bound}")
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), fontsize=9,
                    title="share of the box (published)", title_fontsize=8)  # fmt: skip
    for axes in flat[: len(groups) : COLUMNS]:
        axes.set_ylabel("y in W [m]")
    for axes in flat[len(groups) :]:
        axes.remove()
    return figure


def planar_figure(rows: Frame) -> Figure:
    """The planar robot's workspaces under combinations of errors, one beside the other."""
    panels = panels_of(rows, "3.10")
    figure, grid = new_figure(
        1, len(panels), (5.5 * len(panels), 5.6),
        "Planar robot, PBVS, two combinations of figure 3.1, drawn as figure 3.10",
    )  # fmt: skip
    for k, (axes, row) in enumerate(zip(np.ravel(grid), panels, strict=True)):
        draw_plane(axes, row, marker="s", markersize=5.0, color=nth_look(k).color)
        axes.set(ylabel="y in W [m]", title=f"{row['panel']}: {row['share_percent']:.1f} %")
    return figure


def draw_plane(axes: Any, row: Row, **style: Any) -> None:
    """Positions inside a planar workspace, on axes of its grid."""
    x, y, _ = axes_of(row)
    i, j, _ = np.nonzero(row["arrays"]["inside"])
    axes.plot(x[i], y[j], linestyle="", **style)
    axes.set(
        xlim=(x[0] - 0.05, x[-1] + 0.05), ylim=(y[0] - 0.05, y[-1] + 0.05), aspect="equal",
        xlabel="x in W [m]",
    )  # fmt: skip


STUDY = Study(
    name="stability-shapes",
    title="Shapes of control stability workspaces, drawn as the thesis does",
    source="servoing thesis 3.3, 4.3.1",
    cases=cases,
    parameters=lambda form: {
        "recipe": RECIPE,
        "options": {case.keys["robot"]: recipe_options(case.keys["robot"]) for case in cases(form)},
    },
    assumptions=ASSUMPTIONS,
    coarse=True,
    tables={"Control stability workspaces, share of the box in per cent": share_table},
    figures={
        "shapes_3_8": nested_figure,
        "shapes_3_10": planar_figure,
        **{
            f"shapes_{number.replace('.', '_')}": partial(solids_figure, number=number)
            for number in (*(name for name in PANELS if name != "3.8"), "3.32", "4.2")
        },
    },
)
