"""Workspaces in the robot's scene, as a page for the browser that needs no server.

Every workspace, the hull, and further solids are entries below "workspaces" in the page's menu,
where they can be shown and hidden. The robot is at home, with tensions that hold it under the
limits, mass and wrench of the workspace; if none do, its cables are grey.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from pydrake.geometry import Rgba

from cdpr_drake.analyses.reporting.deferred_figures import Pictures
from cdpr_drake.analyses.visualization.replay import RobotPicture
from cdpr_drake.analyses.visualization.solids import add_solid
from cdpr_drake.analyses.workspaces.conditions import ALL
from cdpr_drake.analyses.workspaces.servo_stability import KINDS as STABILITY_KINDS
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError, InfeasibleTensionError
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.palette import WORKSPACES, Look, rgb
from cdpr_drake.tensions.methods import exact_tensions
from cdpr_drake.workspaces.hull import WorkspaceHull
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
from cdpr_drake.workspaces.volume import WorkspaceVolume, surface_quads, triangles

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


class Layer(NamedTuple):
    """A solid of a workspace.

    Attributes:
        name: Of the workspace; a path in the scene.
        title: What it is, in words.
        share: Of the grid's volume, or of the poses that boxes fill, in words.
        volume: Of the cells whose corners are all inside, of the hull, or of the boxes, in words.
        mesh: Its surface.
        color: Of the surface.
    """

    name: str
    title: str
    share: str
    volume: str
    mesh: Mesh
    color: Rgba


def workspace_page(
    workspace: Workspace, robot: Robot, more: Sequence[Layer] = ()
) -> tuple[Pictures, str]:
    """What writes the page of a workspace, and what should be known of it."""
    layers = workspace_layers(workspace)
    if workspace.hull is not None:
        layers.append(hull_layer(workspace.hull))
    title = f"{workspace.arguments['robot']}: workspaces, {workspace.geometry}"
    if workspace.is_tilted():
        title = f"axes: {workspace.axes_words()}"
    return _page(robot, workspace.arguments["statics"], title, [*layers, *more])


def stability_page(stability: Stability, robot: Robot) -> tuple[Pictures, str]:
    """What writes the page of stability workspaces, and what should be known of it."""
    title = f"{robot.name}: stability of the servo, {stability.geometry}"
    return _page(robot, stability.arguments["statics"], title, stability_layers(stability))


def workspace_layers(workspace: Workspace) -> list[Layer]:
    """What all kinds have in common, if there are several, and each kind."""
    names = [ALL, *workspace.holds] if len(workspace.holds) > 1 else list(workspace.holds)
    colors = [*COLORS, *[COLORS[-1]] * len(names)]
    return [
        _grid_layer(
            name, workspace.title(name), workspace.volume(name), workspace.places(name),
            workspace.grid, color,
        )
        for name, color in zip(names, colors, strict=False)
    ]  # fmt: skip


def stability_layers(stability: Stability) -> list[Layer]:
    """Each kind of workspace under each bounds; S once, for the first bounds."""
    return [
        _grid_layer(
            kind if kind == "S" else f"{name}/{kind}",
            STABILITY_KINDS[kind] + ("" if kind == "S" else f", bounds {name}"),
            stability.volume(kind, bounds=name), stability.places(kind, name), stability.grid,
            color,
        )
        for name in stability.names for kind, color in STABILITY_COLORS.items()
        if kind != "S" or name == stability.names[0]
    ]  # fmt: skip


def _grid_layer(
    name: str, title: str, volume: WorkspaceVolume, places: np.ndarray, grid: WorkspaceGrid,
    color: Rgba,
) -> Layer:  # fmt: skip
    share, size = f"{100.0 * volume.share:.2f} %", f"{volume.value:.4g} {volume.unit}"
    return Layer(name, title, share, size, triangles(surface_quads(places, grid.axes)), color)


def hull_layer(hull: WorkspaceHull) -> Layer:
    """What is seen of a workspace from a centre."""
    title, volume = "what is seen of it from a centre, by rays", f"{hull.volume:.4g} m^3"
    return Layer("hull", title, "–", volume, (hull.vertices, hull.faces), HULL_COLOR)


def _page(
    robot: Robot, statics: Mapping[str, Any], title: str, layers: Sequence[Layer]
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
    for number, layer in enumerate(layers):
        if len(layer.mesh[1]):
            first, color = number == 0, layer.color
            add_solid(
                picture.meshcat, f"workspaces/{layer.name}", *layer.mesh, color, visible=first
            )
            if first:
                hexadecimal = to_hex((color.r(), color.g(), color.b()))
                picture.explain(f"workspace {layer.name}", Look(hexadecimal))
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
