"""The workspace panel: `cdpr workspace` and `cdpr stability`, and their results in the scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from nicegui import ui
from pydrake.geometry import Meshcat

from cdpr_drake.analyses.visualization.solids import add_solid
from cdpr_drake.analyses.workspaces.conditions import MEASURES
from cdpr_drake.analyses.workspaces.stability import load_stability
from cdpr_drake.analyses.workspaces.workspace_hulls import load_hull
from cdpr_drake.analyses.workspaces.workspace_result import load_workspace
from cdpr_drake.analyses.workspaces.workspace_scene import (
    Layer,
    hull_layer,
    stability_layers,
    workspace_layers,
)
from cdpr_drake.arrays import Array
from cdpr_drake.palette import TENSIONS, rgb
from cdpr_drake.proofs.box_figures import box_layers
from cdpr_drake.proofs.certified_workspace import load_boxes
from cdpr_drake.studio.panel import WORKSPACES
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.verb_panel import VerbPanel, Verbs
from cdpr_drake.studio.views import read_numbers

REGIONS, PLANE = "workspaces", "workspaces/plane"
"""Paths in the scene: of all solids, and of the plane with colours."""

UNKNOWN = (0.6, 0.6, 0.6)
"""Colour of poses without a finite value."""

AXES = "xyz"
NOTHING = "none"


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
    layers: list[Layer]
    values: dict[str, Array]
    units: dict[str, str]

    def range(self, name: str) -> tuple[float, float]:
        """Least and largest finite value; NaN where there is none."""
        values = self.values[name][np.isfinite(self.values[name])]
        return (float(values.min()), float(values.max())) if len(values) else (np.nan, np.nan)


def read_regions(folder: Path) -> Regions:
    """Reads the results of `cdpr workspace` or `cdpr stability`.

    Raises:
        CdprError: There are none that can be read.
    """
    summary = read_numbers(folder)
    result: Any
    if isinstance(summary.get("workspaces"), list):
        result = load_stability(folder)
        layers = stability_layers(result)
        names = [f"margin, bounds {name}" for name in result.names]
        values, units = dict(zip(names, result.margin, strict=True)), dict.fromkeys(names, "-")
    else:
        result = load_workspace(folder)
        layers = workspace_layers(result)
        values, units = result.values, {name: MEASURES[name].unit for name in result.values}
    if "hull" in summary:
        layers.append(hull_layer(load_hull(folder)))
    if "certified" in summary:
        layers += box_layers(load_boxes(folder, bool(summary["certified"]["finished"])))
    least = {name: np.asarray(np.min(each, axis=0), float) for name, each in values.items()}
    return Regions(folder, str(summary["robot"]), result.grid.axes, layers, least, units)


def show_regions(meshcat: Meshcat, regions: Regions | None, visible: set[str]) -> None:
    """Puts the solids of regions into a scene in the place of others; `visible` layers are seen.

    Of None nothing is shown any more.
    """
    meshcat.Delete(REGIONS)
    for layer in () if regions is None else regions.layers:
        if len(layer.mesh[1]):
            path = f"{REGIONS}/{layer.name}"
            add_solid(meshcat, path, *layer.mesh, layer.color, visible=layer.name in visible)


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
    colors = colors_of(values.ravel(), regions.range(plane.name))
    meshcat.SetTriangleColorMesh(
        PLANE, np.asfortranarray(points.reshape(-1, 3).T),
        np.asfortranarray(faces.T.astype(np.int32)), np.asfortranarray(colors.T),
    )  # fmt: skip
    # Colours mean numbers: no shadow darkens them, nor a solid before them: they are drawn last.
    for name in ("castShadow", "receiveShadow"):
        meshcat.SetProperty(f"{PLANE}/<object>", name, False)
    meshcat.SetProperty(f"{PLANE}/<object>", "material.transparent", True)
    meshcat.SetProperty(f"{PLANE}/<object>", "renderOrder", 1.0)


def colors_of(values: Array, span: tuple[float, float]) -> Array:
    """Red, green, blue of values, shape (n, 3), from `palette.TENSIONS`; grey where not finite."""
    low, high = span
    shares = (values - low) / max(high - low, 1e-300)
    table = np.array([rgb(color) for color in TENSIONS])
    places = np.linspace(0.0, 1.0, len(table))
    colors = np.column_stack([np.interp(shares, places, column) for column in table.T])
    colors[~np.isfinite(shares)] = UNKNOWN
    return colors


class Workspaces(Verbs):
    """Workspaces that were computed, in all tabs of a session and in its scene.

    Attributes:
        regions: What was computed; None: nothing is shown.
        visible: Names of the layers that are shown.
        plane: The coloured plane; None: there is none.
        in_scene: The regions, if the scene shows the robot that they are of; else None.
    """

    folder, result, names = "workspaces", WORKSPACES, ("workspace", "stability")
    first: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "workspace": ("kind", "measure", "grid", "orientation"),
        "stability": ("scheme", "verdict", "grid", "orientation"),
    }
    empty = (
        "No workspace yet. Choose what the cables must hold (kind) or what is measured at each "
        "pose (measure), then press Start: the open robot is taken, and the result is drawn in the "
        "scene."
    )

    def __init__(self, bench: Workbench) -> None:
        """For a workbench, with nothing in its scene."""
        super().__init__(bench)
        self.regions: Regions | None = None
        self.visible: set[str] = set()
        self.plane: Plane | None = None
        self.in_scene: Regions | None = None
        bench.results.changed.subscribe(self._follow, unsubscribe_on_delete=False)

    def read(self, folder: Path) -> Any:
        """What a command computed."""
        return read_regions(folder)

    def place(self, read: Any) -> None:
        """Places what may be switched on in the scene."""
        if self.regions is None or read.folder != self.regions.folder:
            self.plane, self.visible = None, {layer.name for layer in read.layers[:1]}
        self.regions = read
        _place_layers(read, self)
        _place_plane(read, self)

    def show_layer(self, name: str, visible: bool) -> None:
        """Shows a layer, or hides it."""
        (self.visible.add if visible else self.visible.discard)(name)
        self._draw()

    def show_plane(self, plane: Plane | None) -> None:
        """Puts the coloured plane elsewhere, or takes it away."""
        self.plane, regions = plane, self.in_scene
        if regions is not None:
            self.bench.draw(lambda scene: draw_plane(scene.meshcat, regions, plane))

    def _follow(self) -> None:
        """Takes workspaces out of the scene of another robot, and puts them back."""
        about = self.bench.results.subject(WORKSPACES)
        shown = self.bench.drawn or self.bench.subject
        regions = None if about is None or about.is_another(shown) else self.regions
        if regions is not self.in_scene:
            self.in_scene = regions
            self._draw()

    def _draw(self) -> None:
        regions, visible, plane = self.in_scene, set(self.visible), self.plane

        def draw(scene: Any) -> None:
            show_regions(scene.meshcat, regions, visible)
            if regions is not None:
                draw_plane(scene.meshcat, regions, plane)

        self.bench.draw(draw)


def workspace_panel(bench: Workbench) -> None:
    """Places the workspace panel."""
    shown = bench.kept(Workspaces)
    note = ui.label().classes("studio-soft").mark("regions-note")

    def say_hidden() -> None:
        regions = None if shown.in_scene else shown.regions
        note.set_visibility(regions is not None)
        robot = "" if regions is None else regions.robot
        note.text = f"The workspaces are not in the scene, which does not show that {robot}."

    VerbPanel(shown)
    say_hidden()
    bench.results.changed.subscribe(say_hidden)


def _place_layers(regions: Regions, shown: Workspaces) -> None:
    def cell(tag: str, html: str) -> ui.html:
        return ui.html(html, sanitize=False, tag=tag)

    with ui.element("table").classes("studio-facts").props('aria-label="Workspaces"'):
        with ui.element("thead"), ui.element("tr"):
            for words in ("shown", "workspace", "share", "volume"):
                cell("th", words)
        with ui.element("tbody"):
            for layer in regions.layers:
                name, color = layer.name, layer.color
                shade = ",".join(str(round(255 * x)) for x in (color.r(), color.g(), color.b()))
                style = f"display:inline-block;background:rgb({shade})"
                words = escape(f"{name}: {layer.title}")
                with ui.element("tr"):
                    with ui.element("td"):
                        box = ui.switch(value=name in shown.visible)
                        box.props(f'dense aria-label="show {escape(name)}"').mark(f"layer-{name}")
                        box.set_enabled(len(layer.mesh[1]) > 0)
                        box.on_value_change(
                            lambda event, name=name: shown.show_layer(name, bool(event.value))
                        )
                    cell("th", f'<span class="studio-swatch" style="{style}"></span> {words}')
                    cell("td", layer.share)
                    cell("td", layer.volume).mark(f"volume-{name}")


def _place_plane(regions: Regions, shown: Workspaces) -> None:
    """A plane across the grid, coloured by a measure."""
    sizes = [len(axis) for axis in regions.axes]
    normals = [k for k in range(3) if min(sizes[:k] + sizes[k + 1 :]) > 1]  # what is across extends
    if not regions.values or not normals:
        return
    plane = shown.plane or Plane(NOTHING, 2 if 2 in normals else normals[0], -1)
    with ui.row().classes("w-full items-center"):
        names = [NOTHING, *regions.values]
        what = ui.select(names, value=plane.name, label="colour a plane by")
        what.classes("col").mark("plane-of")
        axes = {k: AXES[k] for k in normals}
        across = ui.select(axes, value=plane.along, label="normal to")
        across.classes("w-24").mark("plane-along")
    last = sizes[plane.along] - 1
    where = ui.slider(min=0, max=last, value=plane.index if plane.index >= 0 else last // 2)
    where.props('aria-label="place of the plane"').mark("plane-index")
    legend = ui.html("", sanitize=False).classes("w-full").mark("plane-legend")

    def follow() -> None:
        along, is_seen = int(across.value), what.value != NOTHING
        last = sizes[along] - 1
        where.props(f"max={last}").set_visibility(is_seen)
        chosen = Plane(str(what.value), along, min(int(where.value), last)) if is_seen else None
        legend.content = "" if chosen is None else _legend(regions, chosen)
        if chosen != shown.plane:
            shown.show_plane(chosen)

    for element in (what, across, where):
        element.on_value_change(follow)
    follow()


def _legend(regions: Regions, plane: Plane) -> str:
    """What the colours of a plane mean, and where it stands."""
    low, high = regions.range(plane.name)
    place = f"{AXES[plane.along]} = {regions.axes[plane.along][plane.index]:.4g} m"
    if not np.isfinite(low):
        return f"{place}: no pose of the grid has a finite value"
    return (
        f"<div>{place}: {escape(plane.name)} [{escape(regions.units[plane.name])}], least over the "
        "orientations; grey: none</div>"
        f'<div style="display:flex;gap:0.6rem;align-items:center"><span>{low:.4g}</span>'
        '<span style="flex:1;height:0.9rem;background:linear-gradient(90deg, '
        f'{", ".join(TENSIONS)})"></span><span>{high:.4g}</span></div>'
    )
