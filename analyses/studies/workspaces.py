"""Study: where the robots that ship can work: every kind of workspace.

Source: servoing thesis 1.3.3, figures 1.17 and 1.18; Gazebo thesis 2.6.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cdpr_drake.analyses.frame.figures import bar_style, bare_figure, new_figure
from cdpr_drake.analyses.studies.study import Case, Form, Frame, Study, select
from cdpr_drake.analyses.visualization.solids import draw_solid
from cdpr_drake.analyses.workspaces.conditions import (
    OF_POSES,
    PoseConditions,
    conditions_at,
)
from cdpr_drake.analyses.workspaces.robot_conditions import grid_conditions, pose_conditions
from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import WORKSPACES, look_of
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid, grid_by_count
from cdpr_drake.workspaces.volume import VolumeRule, surface_quads, workspace_volume

FIGURE, EVERY = "figure", "every kind"
"""What rows are for."""

LOWER_LIMITS = {"acrobot_small": (0.0, 1.0), "acrobot_large": (0.0, 1.0), "caroca": (0.0, 30.0)}
"""Robots and lower tension limits of figures 1.17 and 1.18 [N]. The upper limit is not printed."""

UPPER_SHARES = (1.0, 0.5, 2.0)
"""Upper limits over that of the robot's file, with which the figures are computed."""

STEPS = {"acrobot_small": 0.025, "acrobot_large": 0.025, "caroca": 0.05}
"""Distance of neighbours in the figures, full form, about [m]: half of it changes what is left at a
higher lower limit by less than 0.1 % on CAROCA, by about 1 % on ACROBOT, whose answer is 10 % away
from the limit, see `docs/theory/reproduction.md`."""

QUICK_STEPS = 4.0
"""The quick form's distances are so much larger."""

ROBOTS = (
    "acrobot_fully_constrained", "acrobot_large", "acrobot_small", "caroca", "caroca_gazebo",
    "planar",
)  # fmt: skip
"""Robots of the two theses, of which every kind is looked at."""

KIND_POINTS, QUICK_POINTS = (13, 13, 9), (5, 5, 4)
"""Points along x, y, z over the frame, for all kinds."""

FORCE_SHARE = 0.1
"""Forces to resist along each axis over the robot's weight; moments are these times the arm of its
anchor points."""

ACCELERATIONS = (1.0, 1.0)
"""To have along [m/s^2] and about [rad/s^2] each axis."""

CAMERA_KIND = "target-visible"
"""The kind that needs a scenario: a robot's is `FAMILY_pbvs`, as acrobot_pbvs of acrobot_large."""

ALL, ALL_BUT_CLOSURE = "all", "all but wrench-closure"
"""What all kinds of a robot have in common, and that without the kind that robots hanging on their
cables never have."""

CHUNK = 4096
"""Poses that are decided at once."""

KEPT = 0.9
"""A workspace that keeps this share of its volume remains large, and is not reduced too much."""


# What is measured.


def cases(form: Form) -> Iterator[Case]:
    """Static workspaces of the figures, with upper limits of the file and others; every kind of
    every robot; on coarse grids in the quick form."""
    grid = "coarse" if form.quick else "full"
    for name, lowers in LOWER_LIMITS.items():
        step = STEPS[name] * (QUICK_STEPS if form.quick else 1.0)
        upper = load_robot(name).tension_limits(None)[1]
        for lower, share in product(lowers, UPPER_SHARES):
            limits = (lower, share * upper)
            keys = {"group": FIGURE, **_keys(name, limits), "upper_share": share, "grid": grid}
            yield Case(keys=keys, call=partial(static_row, name, limits, step))
    points = QUICK_POINTS if form.quick else KIND_POINTS
    for name in ROBOTS:
        keys = {"group": EVERY, **_keys(name, load_robot(name).tension_limits(None))}
        keys |= {"upper_share": 1.0, "grid": grid}
        yield Case(keys=keys, call=partial(kinds_row, name, points))


def _keys(name: str, limits: tuple[float, float]) -> dict[str, Any]:
    return {"robot": name, "lower_limit_n": limits[0], "upper_limit_n": limits[1]}


def static_row(name: str, limits: tuple[float, float], step: float) -> dict[str, Any]:
    """A static workspace over the frame, the platform unturned.

    Args:
        name: Of the robot.
        limits: Smallest and largest tension [N].
        step: Distance of neighbours in the grid, about [m].

    Returns:
        As of `poses_row`; pose_share: share of the poses; volume_m3, frame_m3 and frame_share, by
        the cells all of whose corners are inside; points_m3 and half_points_m3: the volume by the
        trapezoidal rule, which converges faster, with all points and with every second one along
        each axis.
    """
    frame = load_robot(name).frame
    cells = (frame.upper - frame.lower) / step
    counts = [2 * round(float(n) / 2.0) + 1 for n in cells]  # odd: every second has both ends
    about = pose_conditions(load_robot(name), limits=limits, pulleys=False)
    grid = frame_grid(name, counts)
    row, axes = poses_row(about, grid, ["static"]), grid.axes
    inside = row["holds_static"]
    volume = workspace_volume(inside, axes, VolumeRule.CORNERS)
    x, y, z = (axis[::2] for axis in axes)
    half = workspace_volume(inside[::2, ::2, ::2], (x, y, z), VolumeRule.POINTS)
    return row | {
        "pose_share": np.mean(inside), "volume_m3": volume.value, "frame_m3": volume.full,
        "frame_share": volume.share,
        "points_m3": workspace_volume(inside, axes, VolumeRule.POINTS).value,
        "half_points_m3": half.value,
    }  # fmt: skip


def kinds_row(name: str, counts: Sequence[int]) -> dict[str, Any]:
    """Every kind that a robot can be asked for, over the frame, the platform unturned.

    Args:
        name: Of the robot.
        counts: Points of the grid along x, y, z.

    Returns:
        As of `poses_row`; required_box_nm_n, acceleration_box_rad_s2_m_s2 and scenario: what was
        asked for; pose_shares, frame_shares, pose_shares_of_pairs: shares of kinds, and of two of
        them; left_out: kinds that the robot cannot be asked for, with the reason.
    """
    grid = frame_grid(name, counts)
    about, kinds, scenario, left_out = possible_kinds(name, grid)
    row, axes = poses_row(about, grid, kinds), grid.axes
    holds = {kind: row[f"holds_{kind}"] for kind in kinds}
    assert about.required is not None
    assert about.motion is not None
    return row | {
        "required_box_nm_n": about.required.box.tolist(),
        "acceleration_box_rad_s2_m_s2": about.motion.accelerations.box.tolist(),
        "scenario": scenario,
        "pose_shares": pose_shares(holds),
        "frame_shares": {
            kind: workspace_volume(inside, axes, VolumeRule.CORNERS).share
            for kind, inside in holds.items()
        },
        "pose_shares_of_pairs": {
            a: {b: float(np.mean(holds[a] & holds[b])) for b in holds} for a in holds
        },
        "left_out": left_out,
    }  # fmt: skip


def poses_row(about: PoseConditions, grid: WorkspaceGrid, kinds: Sequence[str]) -> dict[str, Any]:
    """Where kinds hold: points along each axis; kinds; holds_KIND, shape (nx, ny, nz); x_m, y_m,
    z_m, of the grid."""
    chunks = [
        conditions_at(about, grid, kinds, (k, min(k + CHUNK, grid.size)))
        for k in range(0, grid.size, CHUNK)
    ]
    shape = grid.shape[1:]
    holds = {
        f"holds_{kind}": np.concatenate([chunk[kind] for chunk in chunks]).astype(bool)
        for kind in kinds
    }
    axes = dict(zip(("x_m", "y_m", "z_m"), grid.axes, strict=True))
    return {
        "points": list(shape), "kinds": list(kinds),
        **{name: inside.reshape(shape) for name, inside in holds.items()}, **axes,
    }  # fmt: skip


def pose_shares(holds: Mapping[str, np.ndarray]) -> dict[str, float]:
    """Shares of the poses where each kind holds, where all but one do, and all."""
    others = [inside for kind, inside in holds.items() if kind != "wrench-closure"]
    return {
        **{kind: float(np.mean(inside)) for kind, inside in holds.items()},
        ALL_BUT_CLOSURE: float(np.mean(np.logical_and.reduce(others))),
        ALL: float(np.mean(np.logical_and.reduce(list(holds.values())))),
    }


def frame_grid(name: str, counts: Sequence[int]) -> WorkspaceGrid:
    """Points over a robot's frame, the platform unturned; of a planar robot in its plane."""
    lower, upper = load_robot(name).reach()
    return grid_by_count(lower, upper, counts)


def possible_kinds(
    name: str, grid: WorkspaceGrid
) -> tuple[PoseConditions, list[str], str, dict[str, str]]:
    """Conditions of every kind that a robot can have, the kinds, the scenario, and the reasons why
    it cannot have the others."""
    values = sets_of(load_robot(name))

    def refusal(kind: str, scenario: str | None) -> str:
        try:
            grid_conditions(name, [kind], (), grid, scenario, **values)
        except CdprError as refused:
            return str(refused)
        return ""

    scenario: str | None = f"{name.partition('_')[0]}_pbvs"
    left_out = {}
    if problem := refusal(CAMERA_KIND, scenario):
        where, colon, words = problem.partition(": ")
        left_out[CAMERA_KIND] = f"{Path(where).name}{colon}{words}"  # no folder of this computer
        scenario = None
    refusals = {kind: refusal(kind, scenario) for kind in OF_POSES if kind not in left_out}
    left_out |= {kind: words for kind, words in refusals.items() if words}
    kinds = [kind for kind in OF_POSES if kind not in left_out]
    about = grid_conditions(name, kinds, (), grid, scenario, **values)
    return about, kinds, scenario or "", left_out


def sets_of(robot: Robot) -> dict[str, Any]:
    """Wrenches to resist and accelerations to have, for the kinds of a robot."""
    force = FORCE_SHARE * robot.platform.mass * robot.gravity
    arm = float(np.sqrt(np.mean(np.sum(robot.cable_set().p_PB ** 2, axis=0))))
    linear, angular = ACCELERATIONS
    return {
        "required": SpatialSet(box=np.repeat([force * arm, force], 3)),
        "accelerations": SpatialSet(box=np.repeat([angular, linear], 3)),
        "pulleys": False,  # as the theses have their workspaces
    }


# What facts ask of several rows.


def at_limits(rows: Frame, robot: str) -> list[dict[str, Any]]:
    """Static workspaces of a robot with the file's upper limit, by rising lower limit."""
    mine = select(rows, group=FIGURE, robot=robot, upper_share=1.0)
    return mine.sort_values("lower_limit_n").to_dict("records")


def remains_large(robot: str, rows: Frame) -> tuple[list[bool], str]:
    """Whether the higher lower limit leaves enough volume whatever the grid, and by this one.

    Half as many cells along each axis change what is left by more than its distance from the rule
    if the grid decides.
    """
    low, high = at_limits(rows, robot)
    fine, coarse = (high[name] / low[name] for name in ("points_m3", "half_points_m3"))
    error = abs(fine - coarse)
    shares = ", ".join(
        f"{100.0 * row['frame_share']:.1f} % at {row['lower_limit_n']:g} N" for row in (low, high)
    )
    words = f"{shares} of the frame; keeps {100.0 * fine:.1f} %, within {100.0 * error:.1f} %"
    return [bool(fine - error >= KEPT), bool(fine + error >= KEPT)], words


def platforms_differ(rows: Frame) -> tuple[list[bool], str]:
    """On which share of the poses the platforms of ACROBOT differ, by lower limit."""
    pairs = zip(*(at_limits(rows, f"acrobot_{size}") for size in ("small", "large")), strict=True)
    shares = {
        a["lower_limit_n"]: float(
            np.mean(a["arrays"]["holds_static"] ^ b["arrays"]["holds_static"])
        )
        for a, b in pairs
    }
    words = ", ".join(f"{100.0 * share:.1f} % at {low:g} N" for low, share in shares.items())
    return [share >= 0.02 for share in shares.values()], f"differ on {words}"


# What is shown.


def volume_table(rows: Frame) -> Frame:
    """Volumes of the static workspaces."""
    figures = select(rows, group=FIGURE)
    return Frame({
        "robot": figures["robot"], "upper limit over the file's": figures["upper_share"],
        "lower [N]": figures["lower_limit_n"], "upper [N]": figures["upper_limit_n"],
        "volume [m^3]": figures["volume_m3"], "of the frame [%]": 100.0 * figures["frame_share"],
        "points": [" x ".join(map(str, points)) for points in figures["points"]],
        "grid": figures["grid"],
    })  # fmt: skip


def kind_table(rows: Frame) -> Frame:
    """Shares of every kind [%], a column for each robot."""
    kinds = select(rows, group=EVERY)
    shares = Frame(kinds["pose_shares"].tolist(), index=kinds["robot"])
    table = 100.0 * shares.T.reindex([*OF_POSES, ALL_BUT_CLOSURE, ALL])
    return table.rename_axis("kind").reset_index()


def left_out_table(rows: Frame) -> Frame:
    """Kinds that robots cannot be asked for."""
    return Frame([
        {"robot": row["robot"], "kind": kind, "why": why}
        for row in select(rows, group=EVERY).to_dict("records")
        for kind, why in row["left_out"].items()
    ], columns=["robot", "kind", "why"])  # fmt: skip


def static_figure(number: str, robots: Sequence[str], rows: Frame) -> Figure:
    """Static workspaces as solids in the frame, a row for each robot, as a figure of the thesis."""
    columns = max(len(LOWER_LIMITS[name]) for name in robots)
    figure = bare_figure(
        (5.2 * columns, 0.9 + 4.9 * len(robots)),
        f"Static feasible workspace, as figure {number} of the servoing thesis",
    )
    handles: list[Line2D] = []
    for row, name in enumerate(robots):
        robot = load_robot(name)
        for column, run in enumerate(at_limits(rows, name)):
            arrays = run["arrays"]
            place = 1 + row * columns + column
            axes = figure.add_subplot(
                len(robots), columns, place, projection="3d", computed_zorder=False
            )
            handles = draw_solid(
                axes,
                surface_quads(
                    arrays["holds_static"], (arrays["x_m"], arrays["y_m"], arrays["z_m"])
                ),
                WORKSPACES["SZ"],
                (robot.frame.lower, robot.frame.upper),
                robot.cable_set().p_WA,
            )
            axes.set_title(
                f"{name}, {run['lower_limit_n']:g} to {run['upper_limit_n']:g} N\n"
                f"{run['volume_m3']:.3g} m³, {100.0 * run['frame_share']:.1f} % of the frame",
                fontsize=11, y=1.0, pad=0,
            )  # fmt: skip
    figure.legend(
        handles=handles,
        loc="outside lower center",
        ncols=2,
        title="The thesis does not print the upper limit: the robot file's. Platform unturned;\n"
        "solids are the cells between points of the grid with all eight corners inside.",
        title_fontsize=10,
    )
    return figure


def kinds_figure(rows: Frame) -> Figure:
    """Share of the frame's poses where each kind holds, a bar for each robot."""
    kinds = select(rows, group=EVERY).to_dict("records")
    names = [*OF_POSES, ALL_BUT_CLOSURE, ALL]
    robots = [row["robot"] for row in kinds]
    figure, axes = new_figure(1, 1, (10.0, 9.5), "Where each kind holds, of the poses in the frame")
    size = 0.85 / len(kinds)
    for number, row in enumerate(kinds):
        shares = row["pose_shares"]
        places = np.arange(len(names)) + size * (number - (len(kinds) - 1) / 2.0)
        widths = [100.0 * shares.get(name, np.nan) for name in names]
        axes.barh(
            places, widths, 0.9 * size, label=row["robot"],
            **bar_style(look_of(row["robot"], robots)),
        )  # fmt: skip
        for place in places[np.isnan(widths)]:
            axes.text(0.5, place, "not possible", va="center", fontsize=7)
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_xlim(0.0, 100.0)
    axes.set_xlabel("share of the poses [%]")
    axes.grid(visible=False, axis="y")
    figure.legend(loc="outside lower center", ncols=3)
    return figure


def pairs_figure(rows: Frame) -> Figure:
    """Share of the frame's poses where two kinds hold, a matrix for each robot."""
    kinds = select(rows, group=EVERY).to_dict("records")
    columns = min(3, len(kinds))
    lines = -(-len(kinds) // columns)
    figure, grid = new_figure(
        lines, columns, (1.8 + 4.9 * columns, 1.9 + 4.4 * lines),
        "Where two kinds hold together, of the poses in the frame [%]; one kind on the diagonal, "
        "nothing where a kind is not possible",
    )  # fmt: skip
    panels = list(np.ravel(grid))
    image = None
    for number, (axes, row) in enumerate(zip(panels, kinds, strict=False)):
        names, together = list(OF_POSES), row["pose_shares_of_pairs"]
        shares = np.full((len(names), len(names)), np.nan)
        for a, first in enumerate(names):
            for b, second in enumerate(names[: a + 1]):
                if first in together and second in together:
                    shares[a, b] = 100.0 * together[first][second]
        # Panels of a given aspect shrink after the layout, and names on the left were cut off.
        image = axes.imshow(shares, cmap="Greens", vmin=0.0, vmax=100.0, aspect="auto")
        for (a, b), share in np.ndenumerate(shares):
            if np.isfinite(share):
                color = "white" if share > 55.0 else "black"
                axes.text(b, a, f"{share:.0f}", ha="center", va="center", fontsize=8, color=color)
        axes.grid(visible=False)
        lowest = number + columns >= len(kinds)
        axes.set_xticks(range(len(names)), names if lowest else [], rotation=90, fontsize=9)
        axes.set_yticks(range(len(names)), names if number % columns == 0 else [], fontsize=9)
        most = 100.0 * row["pose_shares"][ALL_BUT_CLOSURE]
        axes.set_title(f"{row['robot']}\n{ALL_BUT_CLOSURE}: {most:.1f} %", fontsize=11)
    for axes in panels[len(kinds) :]:
        axes.remove()
    if image is not None:
        figure.colorbar(image, ax=panels[: len(kinds)], label="share of the poses [%]")
    return figure


STUDY = Study(
    name="workspaces",
    title="Where the robots that ship can work: every kind of workspace",
    source="servoing thesis 1.3.3, figures 1.17 and 1.18; Gazebo thesis 2.6",
    cases=cases,
    assumptions=(
        "The upper tension limit is not printed: the robot file's, half and twice of it.",
    ),
    finds={
        "acrobot_remains_large": partial(remains_large, "acrobot_large"),
        "caroca_remains_large": partial(remains_large, "caroca"),
        "platforms_differ": platforms_differ,
    },
    tables={
        "Static feasible workspace (servoing thesis, figures 1.17 and 1.18), platform unturned": (
            volume_table
        ),
        "Share of the frame's poses where each kind holds [%]": kind_table,
        "Kinds that a robot cannot be asked for": left_out_table,
    },
    figures={
        "static_acrobot": partial(static_figure, "1.17", ("acrobot_small", "acrobot_large")),
        "static_caroca": partial(static_figure, "1.18", ("caroca",)),
        "kinds": kinds_figure,
        "pairs": pairs_figure,
    },
)
