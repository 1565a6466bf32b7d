"""Workspaces in the robot's scene, as a page for the browser that needs no server.

Every workspace, the hull, and further solids are entries below "workspaces" in the page's menu,
where they can be shown and hidden. The robot is at home, with tensions that hold it under the
limits, mass and wrench of the workspace; if none do, its cables are grey.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from pydrake.geometry import Rgba

from cdpr_drake.analyses.reporting.deferred_figures import Pictures
from cdpr_drake.analyses.visualization.replay import RobotPicture
from cdpr_drake.analyses.visualization.solids import add_solid
from cdpr_drake.analyses.workspaces.conditions import ALL
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError, InfeasibleTensionError
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.palette import WORKSPACES, Look, rgb
from cdpr_drake.tensions.methods import exact_tensions
from cdpr_drake.workspaces.hull import WorkspaceHull
from cdpr_drake.workspaces.volume import surface_quads, triangles

if TYPE_CHECKING:
    from cdpr_drake.analyses.workspaces.stability import Stability
    from cdpr_drake.analyses.workspaces.workspace_result import Workspace

PAGE = "workspace.html"
"""The page."""

COLORS = (
    Rgba(0.25, 0.56, 0.37, 0.55),
    Rgba(0.48, 0.65, 0.85, 0.45),
    Rgba(0.94, 0.76, 0.48, 0.45),
    Rgba(0.80, 0.47, 0.65, 0.45),
    Rgba(0.60, 0.60, 0.60, 0.45),
)
"""Colours of what all kinds have in common, then of the kinds in turn."""

HULL_COLOR = Rgba(0.48, 0.65, 0.85, 0.45)

STABILITY_COLORS = {
    "SZ": Rgba(*rgb(WORKSPACES["SZ"]), 0.55),
    "Z": Rgba(*rgb(WORKSPACES["Z"]), 0.45),
    "S": Rgba(*rgb(WORKSPACES["S"]), 0.45),
}
"""Colours of kinds of stability; the first is visible, the others wait in the menu."""

Mesh = tuple[Array, np.ndarray]
"""Vertices, shape (n, 3) [m], and triangles, shape (k, 3); none of what is empty."""


def workspace_page(
    workspace: Workspace, robot: Robot, more: Sequence[tuple[str, Mesh, Rgba]] = ()
) -> tuple[Pictures, str]:
    """What writes the page of a workspace, and what should be known of it; `more` are solids."""
    solids = workspace_solids(workspace)
    if workspace.hull is not None:
        solids.append(("hull", *hull_solid(workspace.hull)))
    solids += more
    title = f"{workspace.arguments['robot']}: workspaces, {workspace.geometry}"
    if workspace.is_tilted():
        title = f"axes: {workspace.axes_words()}"
    return _page(robot, workspace.arguments["statics"], title, solids)


def stability_page(stability: Stability, robot: Robot) -> tuple[Pictures, str]:
    """What writes the page of stability workspaces, and what should be known of it."""
    solids = [
        (f"{name}/{kind}" if kind != "S" else "S", mesh, color)
        for name, kind, mesh, color in stability_solids(stability)
    ]
    title = f"{robot.name}: stability of the servo, {stability.geometry}"
    return _page(robot, stability.arguments["statics"], title, solids)


def workspace_solids(workspace: Workspace) -> list[tuple[str, Mesh, Rgba]]:
    """What all kinds have in common, if there are several, and each kind."""
    names = [ALL, *workspace.holds] if len(workspace.holds) > 1 else list(workspace.holds)
    colors = [*COLORS, *[COLORS[-1]] * len(names)]
    return [
        (name, triangles(surface_quads(workspace.places(name), workspace.grid.axes)), color)
        for name, color in zip(names, colors, strict=False)
    ]


def stability_solids(stability: Stability) -> list[tuple[str, str, Mesh, Rgba]]:
    """Bounds and kind of each workspace, and its mesh; S once, for the first bounds."""
    return [
        (name, kind, triangles(surface_quads(stability.places(kind, name), stability.grid.axes)),
         color)
        for name in stability.names for kind, color in STABILITY_COLORS.items()
        if kind != "S" or name == stability.names[0]
    ]  # fmt: skip


def hull_solid(hull: WorkspaceHull) -> tuple[Mesh, Rgba]:
    """A hull and its colour."""
    return (hull.vertices, hull.faces), HULL_COLOR


def _page(
    robot: Robot, statics: Mapping[str, Any], title: str, solids: Sequence[tuple[str, Mesh, Rgba]]
) -> tuple[Pictures, str]:
    """The page, with the first solid visible; words if cables are grey, or if there is no page."""
    from matplotlib.colors import to_hex  # half a second, which a scene needs not

    tensions, problem = _home_tensions(statics, robot)
    # Twice the largest tension is the end of the colours, which also tell home from full load.
    most = 0.0 if problem else 2.0 * float(np.max(tensions))
    try:
        picture = RobotPicture(robot, most)
        picture.draw(robot.home.transform(), tensions)
    except CdprError as undrawn:
        return {}, f"{PAGE} is left out, the robot cannot be drawn at home: {undrawn}"
    picture.title = title
    for number, (path, mesh, color) in enumerate(solids):
        if len(mesh[1]):
            first = number == 0
            add_solid(picture.meshcat, f"workspaces/{path}", *mesh, color, visible=first)
            if first:
                hexadecimal = to_hex((color.r(), color.g(), color.b()))
                picture.explain(f"workspace {path}", Look(hexadecimal))
    note = f"{PAGE} shows the robot at home without tensions: {problem}" if problem else ""
    return {PAGE: lambda path: path.write_text(picture.html(), encoding="utf-8")}, note


def _home_tensions(statics: Mapping[str, Any], robot: Robot) -> tuple[Array, str]:
    """Tensions of least 2-norm at home, shape (m,) [N]; NaN and the reason if there are none.

    Limits, mass and wrench are those of a `StaticCase` among the arguments of a workspace.
    """
    X_WP = robot.home.transform()
    mass = statics["weight"] / robot.gravity if robot.gravity > 0.0 else None
    limits = (statics["lower"][0], statics["upper"][0])
    try:
        problem = tension_problem(
            robot, X_WP, np.array(statics["wrench"]), limits=limits, mass=mass,
            cables=robot.cable_set(pulleys="pulley_radius" in statics["cables"]),
        )  # fmt: skip
        tensions = exact_tensions(problem)
        if tensions is None:
            place = ", ".join(f"{x:g}" for x in X_WP.translation())
            raise InfeasibleTensionError(
                f"no tensions within {limits[0]:g}..{limits[1]:g} N hold the platform at "
                f"({place}) m"
            )
    except CdprError as refusal:
        return np.full(len(robot.cables), np.nan), str(refusal)
    return tensions, ""
