"""Control stability workspaces in the robot's scene, as a page for the browser."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from pydrake.geometry import Rgba

from cdpr_drake.analyses.reporting.deferred_figures import Pictures
from cdpr_drake.analyses.visualization.replay import RobotPicture
from cdpr_drake.analyses.visualization.solids import add_solid
from cdpr_drake.analyses.workspaces.stability_results import StabilityWorkspaces
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError, InfeasibleTensionError
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.palette import WORKSPACES, rgb
from cdpr_drake.tensions.methods import exact_tensions
from cdpr_drake.workspaces.volume import surface_quads, triangles

PAGE = "workspace.html"
"""The page."""

SOLIDS = {
    "SZ": Rgba(*rgb(WORKSPACES["SZ"]), 0.55),
    "Z": Rgba(*rgb(WORKSPACES["Z"]), 0.45),
    "S": Rgba(*rgb(WORKSPACES["S"]), 0.45),
}
"""Kinds with their colours; the first is visible, the others wait in the menu."""


def workspace_html(workspaces: StabilityWorkspaces, robot: Robot) -> str:
    """The robot at home with its workspaces as one page that needs no server.

    Every workspace is an entry below "workspaces" in the page's menu, where it can be shown and
    hidden; SZ of the first bounds is visible. Where the home pose cannot be held, the cables are
    grey.
    """
    return _page(workspaces, robot, home_tensions(workspaces.arguments["statics"], robot)[0])


def home_tensions(about: Mapping[str, Any], robot: Robot) -> tuple[Array, str]:
    """Tensions at the home pose under the limits, mass and wrench of a question about workspaces.

    Args:
        about: Its `statics`: what a question's `arguments` have of a `StaticCase`.
        robot: The robot.

    Returns:
        Tensions of least 2-norm, shape (m,) [N], NaN where there are none; why there are none,
        empty where there are.
    """
    X_WP = robot.home.transform()
    mass = about["weight"] / robot.gravity if robot.gravity > 0.0 else None
    limits = (about["lower"][0], about["upper"][0])
    try:
        problem = tension_problem(
            robot, X_WP, np.array(about["wrench"]), limits=limits, mass=mass,
            cables=robot.cable_set(pulleys="pulley_radius" in about["cables"]),
        )  # fmt: skip
        tensions = exact_tensions(problem)
        if tensions is None:
            place = ", ".join(f"{x:g}" for x in X_WP.translation())
            raise InfeasibleTensionError(
                f"no tensions within {limits[0]:g}..{limits[1]:g} N hold the platform at "
                f"({place}) m"
            )
    except CdprError as problem_there:
        return np.full(len(robot.cables), np.nan), str(problem_there)
    return tensions, ""


def _page(workspaces: StabilityWorkspaces, robot: Robot, tensions: Array) -> str:
    picture = held_picture(robot, tensions)
    picture.title = f"{robot.name}: stability of the servo, {workspaces.geometry}"
    for name, kind, solid, color in stability_solids(workspaces):
        if not len(solid[1]):
            continue
        path = f"workspaces/{name}/{kind}" if kind != "S" else "workspaces/S"
        shown = name == workspaces.names[0] and kind == "SZ"
        add_solid(picture.meshcat, path, *solid, color, visible=shown)
    return picture.html()


def held_picture(robot: Robot, tensions: Array) -> RobotPicture:
    """A robot at home with tensions of `home_tensions`, coloured up to twice the largest one.

    So colours also tell the home pose from full load; NaN are grey.
    """
    most = 0.0 if np.any(np.isnan(tensions)) else 2.0 * float(np.max(tensions))
    picture = RobotPicture(robot, most)
    picture.draw(robot.home.transform(), tensions)
    return picture


def stability_solids(
    workspaces: StabilityWorkspaces,
) -> list[tuple[str, str, tuple[Array, np.ndarray], Rgba]]:
    """Each workspace of each bounds: bounds, kind, solid, colour; S once, for the first bounds.

    A solid is vertices, shape (n, 3) [m], and triangles, shape (k, 3); none of an empty one.
    """
    return [
        (
            name,
            kind,
            triangles(surface_quads(workspaces.places(kind, name), workspaces.grid.axes)),
            color,
        )
        for number, name in enumerate(workspaces.names)
        for kind, color in SOLIDS.items()
        if kind != "S" or number == 0  # the same for all bounds
    ]


def scene_page(workspaces: StabilityWorkspaces, robot: Robot) -> tuple[Pictures, str]:
    """What writes the page, and what there is to say about it.

    Words are empty if it is as it should be. Else the home pose cannot be held, so that cables are
    grey, or cannot be drawn, so that there is no page.
    """
    tensions, why = home_tensions(workspaces.arguments["statics"], robot)
    try:
        page = _page(workspaces, robot, tensions)
    except CdprError as problem:
        return {}, f"{PAGE} is left out, the robot cannot be drawn at home: {problem}"
    words = f"{PAGE} shows the robot at home without tensions: {why}" if why else ""
    return {PAGE: lambda path: path.write_text(page, encoding="utf-8")}, words
