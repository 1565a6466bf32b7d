"""Workspaces that a command left in a folder, as solids and coloured planes for the scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.geometry import Meshcat, Rgba

from cdpr_drake.analyses.visualization.solids import add_solid
from cdpr_drake.analyses.workspaces.conditions import MEASURES
from cdpr_drake.analyses.workspaces.servo_stability import KINDS as STABILITY_KINDS
from cdpr_drake.analyses.workspaces.stability import load_stability
from cdpr_drake.analyses.workspaces.workspace_hulls import load_hull
from cdpr_drake.analyses.workspaces.workspace_result import load_workspace
from cdpr_drake.analyses.workspaces.workspace_scene import (
    hull_solid,
    stability_solids,
    workspace_solids,
)
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError
from cdpr_drake.palette import TENSIONS, rgb
from cdpr_drake.proofs.box_figures import box_solids
from cdpr_drake.proofs.certified_workspace import load_boxes
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
from cdpr_drake.workspaces.volume import WorkspaceVolume

REGIONS, PLANE = "workspaces", "workspaces/plane"
"""Paths in the scene: of all solids, and of the plane with colours."""

UNKNOWN = (0.6, 0.6, 0.6)
"""Colour of poses without a finite value."""

RESULTS = "results.json"


@dataclass(frozen=True, eq=False)
class Layer:
    """One workspace that can be shown.

    Attributes:
        name: Of the workspace.
        title: What it is, in words.
        volume: Of the cells whose corners are all inside, of the hull, or of the boxes, as the
            command prints it; None of boxes that are proven for a range of orientations.
        unit: Of the volume.
        share: Of the grid's volume, or of the poses that boxes fill; None of a hull.
        solid: Vertices, shape (n, 3) [m], and triangles, shape (k, 3); None: it is empty.
        color: Of the solid.
    """

    name: str
    title: str
    volume: float | None
    unit: str
    share: float | None
    solid: tuple[Array, np.ndarray] | None
    color: Rgba


@dataclass(frozen=True)
class Plane:
    """Where a coloured plane stands: name of its values, axis 0 to 2 that it is normal to, and
    number of the grid's plane along that axis."""

    name: str
    along: int
    index: int


@dataclass(frozen=True, eq=False)
class Regions:
    """What a results folder has.

    Attributes:
        folder: The folder.
        robot: Name of the robot.
        axes: Coordinates of the grid, shape (n,) each [m].
        layers: Workspaces.
        values: Least value over the orientations by name, shape (nx, ny, nz).
        units: Of the values.
    """

    folder: Path
    robot: str
    axes: tuple[Array, Array, Array]
    layers: tuple[Layer, ...]
    values: dict[str, Array]
    units: dict[str, str]

    def range(self, name: str) -> tuple[float, float]:
        """Least and largest finite value; NaN where there is none."""
        values = self.values[name][np.isfinite(self.values[name])]
        return (float(values.min()), float(values.max())) if len(values) else (np.nan, np.nan)

    def normals(self) -> list[int]:
        """Axes along which a plane may be moved: the other two have an extent."""
        sizes = [len(axis) for axis in self.axes]
        return [k for k in range(3) if all(sizes[j] > 1 for j in range(3) if j != k)]


def read_regions(folder: Path) -> Regions:
    """Reads the results of `cdpr workspace` or `cdpr stability`.

    Raises:
        CdprError: There are none that can be read.
    """
    try:
        summary = load_json((folder / RESULTS).read_text(encoding="utf-8"))
        of_stability = isinstance(summary["workspaces"], list)
    except (OSError, ValueError, KeyError, TypeError) as problem:
        raise CdprError(f"{folder.name}: {RESULTS} cannot be read: {problem}") from problem
    grid, layers, values, units = (_of_stability if of_stability else _of_kinds)(folder, summary)
    least = {name: np.asarray(np.min(each, axis=0), float) for name, each in values.items()}
    return Regions(folder, str(summary["robot"]), grid.axes, tuple(layers), least, units)


_Parts = tuple[WorkspaceGrid, list[Layer], Mapping[str, Array], dict[str, str]]
"""Grid, layers, values at its poses by name, and their units."""


def _of_stability(folder: Path, summary: Mapping[str, Any]) -> _Parts:
    stability = load_stability(folder)
    layers = []
    for bounds, kind, solid, color in stability_solids(stability):
        title = STABILITY_KINDS[kind] + ("" if kind == "S" else f", bounds {bounds}")
        volume = stability.volume(kind, bounds=bounds)
        layers.append(_layer(f"{bounds} {kind}", title, volume, solid, color))
    names = [f"margin, bounds {name}" for name in stability.names]
    values = dict(zip(names, stability.margin, strict=True))
    return stability.grid, layers, values, dict.fromkeys(names, "-")


def _of_kinds(folder: Path, summary: Mapping[str, Any]) -> _Parts:
    workspace = load_workspace(folder)
    layers = [
        _layer(name, summary["workspaces"][name]["title"], workspace.volume(name), solid, color)
        for name, solid, color in workspace_solids(workspace)
    ]
    if "hull" in summary:
        hull = load_hull(folder)
        title = "what is seen of it from a centre, by rays"
        layers.append(Layer("hull", title, hull.volume, "m^3", None, *hull_solid(hull)))
    if "certified" in summary:
        layers += _box_layers(folder, bool(summary["certified"]["finished"]))
    units = {name: MEASURES[name].unit for name in workspace.values}
    return workspace.grid, layers, workspace.values, units


def _layer(name: str, title: str, volume: WorkspaceVolume, solid: Any, color: Rgba) -> Layer:
    drawn = solid if len(solid[1]) else None
    return Layer(name, title, volume.value, volume.unit, volume.share, drawn, color)


def _box_layers(folder: Path, finished: bool) -> list[Layer]:
    """Boxes by what is proven of them."""
    boxes = load_boxes(folder, finished)
    sizes = np.ptp(np.concatenate([boxes.poses - boxes.halves, boxes.poses + boxes.halves]), axis=0)
    # Boxes of several orientations lie upon each other: what they fill is no volume of positions.
    whole = None if np.any(sizes[3:] > 0.0) else float(np.prod(sizes[:3]))
    layers = []
    for name, count, solid, color in box_solids(boxes):
        share = float(getattr(boxes, name))
        volume = None if whole is None else share * whole
        title = f"{'nothing is proven' if name == 'open' else f'proven {name}'}, {count}"
        layers.append(Layer(f"boxes {name}", title, volume, "m^3", share, solid, color))
    return layers


def show_regions(meshcat: Meshcat, regions: Regions | None, visible: set[str]) -> None:
    """Puts the solids of regions into a scene in the place of others; `visible` layers are seen.

    Of None nothing is shown any more.
    """
    meshcat.Delete(REGIONS)
    for layer in () if regions is None else regions.layers:
        if layer.solid is not None:
            path = f"{REGIONS}/{layer.name}"
            add_solid(meshcat, path, *layer.solid, layer.color, visible=layer.name in visible)


def draw_plane(meshcat: Meshcat, regions: Regions, plane: Plane | None) -> None:
    """Puts the coloured plane into a scene, or takes it out."""
    if plane is None:
        meshcat.Delete(PLANE)
        return
    grid = np.stack(np.meshgrid(*regions.axes, indexing="ij"), axis=-1)
    points, values = (
        np.take(each, plane.index, plane.along) for each in (grid, regions.values[plane.name])
    )
    corner = np.arange(values.size).reshape(values.shape)
    quads = np.stack([corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]], axis=-1)
    faces = quads.reshape(-1, 4)[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    vertices, values = points.reshape(-1, 3), values.ravel()
    colors = colors_of(values, regions.range(plane.name))
    meshcat.SetTriangleColorMesh(
        PLANE, np.asfortranarray(vertices.T), np.asfortranarray(faces.T.astype(np.int32)),
        np.asfortranarray(colors.T),
    )  # fmt: skip
    # Colours mean numbers: no shadow darkens them, nor a solid before them: they are drawn last.
    for name in ("castShadow", "receiveShadow"):
        meshcat.SetProperty(f"{PLANE}/<object>", name, False)
    meshcat.SetProperty(f"{PLANE}/<object>", "material.transparent", True)
    meshcat.SetProperty(f"{PLANE}/<object>", "renderOrder", 1.0)


def colors_of(values: Array, span: tuple[float, float]) -> Array:
    """Red, green, blue of values, shape (n, 3), from `palette.TENSIONS`; grey where not finite."""
    low, high = span
    table = np.array([rgb(color) for color in TENSIONS])
    share = (values - low) / max(high - low, 1e-300) if np.isfinite(low) else values
    finite = np.isfinite(share)
    place = np.clip(np.where(finite, share, 0.0), 0.0, 1.0) * (len(table) - 1)
    colors = np.column_stack([np.interp(place, range(len(table)), column) for column in table.T])
    colors[~finite] = UNKNOWN
    return np.asarray(colors)
