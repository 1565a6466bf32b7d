"""The workspace panel: `cdpr workspace` and `cdpr stability`, and their results in the scene.

A results folder becomes `Regions`: layers, which are solids, and values for a coloured plane.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary, ref

import numpy as np
from nicegui import run, ui
from pydrake.geometry import Meshcat, Rgba

from cdpr_drake.analyses.visualization.solids import add_solid
from cdpr_drake.analyses.workspaces.conditions import KINDS, MEASURES
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
from cdpr_drake.stability.stability_case import SCHEMES
from cdpr_drake.stability.verdict import VERDICTS
from cdpr_drake.studio.boards import CommandBoard
from cdpr_drake.studio.calculator import Signal
from cdpr_drake.studio.job_bar import JobBar
from cdpr_drake.studio.jobs import JobState
from cdpr_drake.studio.panel import (
    WORKSPACES,
    message,
    notify,
    on_page,
    robot_argument,
    show_errors,
)
from cdpr_drake.studio.panels.command_fields import Choices, CommandFields, Filled
from cdpr_drake.studio.results import Subject
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.workbench.command_form import FieldProblem
from cdpr_drake.systems.scenarios.files import robot_scenario_names
from cdpr_drake.workspaces.volume import WorkspaceVolume

REGIONS, PLANE = "workspaces", "workspaces/plane"
"""Paths in the scene: of all solids, and of the plane with colours."""

UNKNOWN = (0.6, 0.6, 0.6)
"""Colour of poses without a finite value."""

RESULTS = "results.json"

TICK = 0.5
"""Time between looks at jobs and folders [s]."""

BELOW = "workspaces"
"""Folder of results in the working folder."""

TITLES = {"workspace": "Workspaces: kinds and measures", "stability": "Stability of the servo"}
"""Of the commands."""

FIRST = {
    "workspace": ("kind", "measure", "grid", "orientation"),
    "stability": ("scheme", "verdict", "grid", "orientation"),
}
"""Options that are always shown."""

EMPTY = (
    "No workspace yet. Choose what the cables must hold (kind) or what is measured at each pose "
    "(measure), then press Start: the open robot is taken, and the result is drawn in the scene."
)

AXES = "xyz"
NOTHING = "none"


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
    values: dict[str, Array] = {}
    if of_stability:
        stability = load_stability(folder)
        axes, units = stability.grid.axes, dict[str, str]()
        layers = [
            _layer(
                f"{bounds} {kind}",
                STABILITY_KINDS[kind] + ("" if kind == "S" else f", bounds {bounds}"),
                stability.volume(kind, bounds=bounds), solid, color,
            )
            for bounds, kind, solid, color in stability_solids(stability)
        ]  # fmt: skip
        for name, margin in zip(stability.names, stability.margin, strict=True):
            values[f"margin, bounds {name}"], units[f"margin, bounds {name}"] = margin, "-"
    else:
        workspace = load_workspace(folder)
        axes, units = workspace.grid.axes, {name: MEASURES[name].unit for name in workspace.values}
        layers = [
            _layer(name, summary["workspaces"][name]["title"], workspace.volume(name), solid, color)
            for name, solid, color in workspace_solids(workspace)
        ]
        values = workspace.values
        if "hull" in summary:
            hull = load_hull(folder)
            title = "what is seen of it from a centre, by rays"
            layers.append(Layer("hull", title, hull.volume, "m^3", None, *hull_solid(hull)))
        if "certified" in summary:
            layers += _box_layers(folder, bool(summary["certified"]["finished"]))
    least = {name: np.asarray(np.min(each, axis=0), float) for name, each in values.items()}
    return Regions(folder, str(summary["robot"]), axes, tuple(layers), least, units)


def _layer(name: str, title: str, volume: WorkspaceVolume, solid: Any, color: Rgba) -> Layer:
    drawn = solid if len(solid[1]) else None
    return Layer(name, title, volume.value, volume.unit, volume.share, drawn, color)


def _box_layers(folder: Path, finished: bool) -> list[Layer]:
    """Boxes by what is proven of them."""
    boxes = load_boxes(folder, finished)
    shares = {"inside": boxes.inside, "outside": boxes.outside, "open": boxes.open}
    words = {"inside": "proven inside", "outside": "proven outside", "open": "nothing is proven"}
    sizes = np.ptp(np.concatenate([boxes.poses - boxes.halves, boxes.poses + boxes.halves]), axis=0)
    # Boxes of several orientations lie upon each other: what they fill is no volume of positions.
    whole = None if np.any(sizes[3:] > 0.0) else float(np.prod(sizes[:3]))
    return [
        Layer(
            f"boxes {name}", f"{words[name]}, {count}",
            None if whole is None else shares[name] * whole, "m^3", shares[name], solid, color,
        )
        for name, count, solid, color in box_solids(boxes)
    ]  # fmt: skip


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
    u, v = (k for k in range(3) if k != plane.along)
    axes = regions.axes
    first, second = np.meshgrid(axes[u], axes[v], indexing="ij")
    vertices = np.empty((first.size, 3))
    vertices[:, u], vertices[:, v] = first.ravel(), second.ravel()
    vertices[:, plane.along] = axes[plane.along][plane.index]
    values = np.take(regions.values[plane.name], plane.index, plane.along).ravel()
    corner = np.arange(first.size).reshape(first.shape)
    a, b = corner[:-1, :-1].ravel(), corner[1:, :-1].ravel()
    c, d = corner[1:, 1:].ravel(), corner[:-1, 1:].ravel()
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
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


class RegionView:
    """What a session sees of computed workspaces, in all its tabs and in its scene.

    Attributes:
        board: Commands and their results.
        filled: What was filled into the forms.
        command: Which form is shown.
        regions: What is in the scene; None: nothing.
        visible: Names of the layers that are shown.
        plane: The coloured plane; None: there is none.
        changed: Called when any of these has changed.
    """

    def __init__(self, bench: Workbench) -> None:
        """For a workbench, with nothing in its scene."""
        self._bench = ref(bench)  # which this is kept by
        self.board = CommandBoard(
            bench.jobs, bench.folder.root, BELOW,
            {name: bench.commands[name] for name in TITLES if name in bench.commands},
        )  # fmt: skip
        self.filled, self.command = Filled(), "workspace"
        self.regions: Regions | None = None
        self.visible: set[str] = set()
        self.plane: Plane | None = None
        self.changed = Signal()
        self._in_scene: Regions | None = None
        bench.results.changed.connect(self._follow)

    @property
    def is_hidden(self) -> bool:
        """Whether the scene shows another robot than the one that these are workspaces of."""
        bench = self._bench()
        if bench is None or self.regions is None:
            return False
        about = bench.results.subject(WORKSPACES)
        return about is not None and about.is_another(bench.drawn or bench.subject)

    def _follow(self) -> None:
        """Takes workspaces out of the scene of another robot, and puts them back."""
        if (None if self.is_hidden else self.regions) is not self._in_scene:
            self._show_all()

    def _show_all(self) -> None:
        regions = self._in_scene = None if self.is_hidden else self.regions
        visible, plane = set(self.visible), self.plane

        def draw(scene: Any) -> None:
            show_regions(scene.meshcat, regions, visible)
            if regions is not None and plane is not None:
                draw_plane(scene.meshcat, regions, plane)

        self._draw(draw)

    def take(self, regions: Regions | None, about: Subject | None = None) -> None:
        """Shows other regions, the first of them, or none; `about` is what they are of."""
        self.regions = self.plane = None
        bench = self._bench()
        if bench is not None:
            bench.results.show(WORKSPACES, about)
        self.regions = regions
        self.visible = {layer.name for layer in regions.layers[:1]} if regions else set()
        self._show_all()

    def show_layer(self, name: str, wanted: bool) -> None:
        """Shows a layer, or hides it."""
        (self.visible.add if wanted else self.visible.discard)(name)
        self._show_all()

    def show_plane(self, plane: Plane | None) -> None:
        """Puts the coloured plane elsewhere, or takes it away."""
        self.plane, regions = plane, self._in_scene
        if regions is not None:
            self._draw(lambda scene: draw_plane(scene.meshcat, regions, plane))

    def _draw(self, draw: Callable[[Any], None]) -> None:
        bench = self._bench()
        if bench is not None:
            bench.draw(draw)
        self.changed.emit()


_views: WeakKeyDictionary[Workbench, RegionView] = WeakKeyDictionary()
"""What each session sees, as long as it has a workbench."""


def workspace_panel(bench: Workbench) -> None:
    """Places the workspace panel."""
    if bench not in _views:
        _views[bench] = RegionView(bench)
    _WorkspacePanel(bench, _views[bench])


class _WorkspacePanel:
    """The panel in one tab of a browser."""

    def __init__(self, bench: Workbench, view: RegionView) -> None:
        self._bench, self._view = bench, view
        self._fields: CommandFields | None = None
        self._started = 0
        titles = {name: TITLES[name] for name in TITLES if name in bench.commands}
        with ui.row().classes("w-full items-center no-wrap"):
            what = ui.select(titles, value=view.command, label="compute").mark("command")
            what.props("dense outlined").classes("col")
            start = ui.button("Start", icon="play_circle", on_click=self._start).props("no-caps")
            start.mark("start-workspace")
        self._form = ui.element("div").classes("w-full")
        what.on_value_change(lambda: self._place_form(str(what.value)))
        self._place_form(view.command)
        self._bar = JobBar(view.board, "results")
        self._note = ui.label().classes("studio-soft").mark("regions-note")
        self._empty = ui.label(EMPTY).classes("studio-empty").mark("workspace-empty")
        self._body = ui.element("div").classes("w-full")
        self._placed: Regions | None = None
        self._refresh()
        on_page(view.changed, self._refresh)
        on_page(bench.results.changed, self._refresh)
        ui.timer(TICK, self._tick)

    def _place_form(self, command: str) -> None:
        self._view.command = command
        self._form.clear()
        choices = {
            "kind": Choices(list(KINDS), several=True),
            "measure": Choices(list(MEASURES), several=True),
            "orientations": Choices(["all", "any"]),
            "scheme": Choices(list(SCHEMES)),
            "verdict": Choices(list(VERDICTS)),
            "scenario": Choices(robot_scenario_names()),
        }
        form = self._bench.commands[command]
        names = {option.key for option in form.options}
        with self._form, show_errors():
            self._fields = CommandFields(
                form, self._view.filled, FIRST[command],
                {name: choice for name, choice in choices.items() if name in names},
                self._bench.folder,
            )  # fmt: skip

    def _start(self) -> None:
        with show_errors():
            if self._fields is None:
                return
            try:
                options = self._fields.arguments()
            except FieldProblem:
                return  # the field says it
            form, robot = self._fields.form, robot_argument(self._bench)
            name = f"{self._bench.robot.value.name}-{form.name}"
            now = self._bench.subject
            about = {"robot": now.robot, "digest": now.digest}
            job = self._view.board.start(name, [form.name, robot, *options], about)
            self._started = job.number
            self._bar.refresh()

    async def _tick(self) -> None:
        with show_errors():
            self._bar.refresh()
            self._say_mistake()
            self._empty.set_visibility(self._view.regions is None and not self._view.board.shown)
            entry = self._bar.computed
            over = entry is not None and (entry.job is None or entry.job.state == JobState.FINISHED)
            folder = entry.folder if entry is not None and over and entry.is_whole else None
            if folder == (None if self._view.regions is None else self._view.regions.folder):
                return
            if folder is None or entry is None:
                self._view.take(None)
                return
            try:
                regions = await run.io_bound(read_regions, folder)
            except Exception as problem:
                self._view.board.shown = ""
                notify(message(problem))
                return
            if regions is not None:  # else the server is ending
                same = entry.about.get("robot") == regions.robot
                digest = entry.about.get("digest", "") if same else ""
                self._view.take(regions, Subject(regions.robot, digest))

    def _say_mistake(self) -> None:
        """Puts what the command of this tab refused beside the field that it names."""
        job = self._bench.jobs.job(self._started) if self._started else None
        if job is None or not job.state.is_over or self._fields is None:
            return
        self._started = 0
        if job.state == JobState.FAILED:
            self._fields.say(self._fields.form.field_of(job.message), job.message)

    def _refresh(self) -> None:
        """Follows what the session sees."""
        regions = self._view.regions
        if regions is not self._placed:
            self._placed = regions
            self._body.clear()
            with self._body:
                if regions is not None:
                    self._place_layers(regions)
                    self._place_plane(regions)
        self._empty.set_visibility(regions is None and not self._view.board.shown)
        hidden = regions is not None and self._view.is_hidden
        self._note.set_visibility(hidden)
        if regions is not None and hidden:
            self._note.text = (
                f"They are not in the scene, which does not show that {regions.robot}."
            )

    def _place_layers(self, regions: Regions) -> None:
        with ui.element("table").classes("studio-facts").props('aria-label="Workspaces"'):
            with ui.element("thead"), ui.element("tr"):
                for words in ("shown", "workspace", "share", "volume"):
                    with ui.element("th"):
                        ui.label(words)
            with ui.element("tbody"):
                for layer in regions.layers:
                    self._place_layer(layer)

    def _place_layer(self, layer: Layer) -> None:
        name, color = escape(layer.name), layer.color
        red, green, blue = (round(255 * part) for part in (color.r(), color.g(), color.b()))
        swatch = f"display:inline-block;background:rgb({red},{green},{blue})"
        with ui.element("tr"):
            with ui.element("td"):
                box = ui.switch(value=layer.name in self._view.visible)
                box.props(f'dense aria-label="show {name}"').mark(f"layer-{layer.name}")
                box.set_enabled(layer.solid is not None)
                box.on_value_change(
                    lambda event: self._view.show_layer(layer.name, bool(event.value))
                )
            with ui.element("th"):
                ui.html(
                    f'<span class="studio-swatch" style="{swatch}"></span> {name}: '
                    f"{escape(layer.title)}",
                    sanitize=False,
                )
            with ui.element("td"):
                ui.label("–" if layer.share is None else f"{100.0 * layer.share:.2f} %")
            with ui.element("td"):
                words = "–" if layer.volume is None else f"{layer.volume:.4g} {layer.unit}"
                ui.label(words).mark(f"volume-{layer.name}")

    def _place_plane(self, regions: Regions) -> None:
        normals = regions.normals()
        if not regions.values or not normals:
            return
        plane = self._view.plane or Plane(NOTHING, 2 if 2 in normals else normals[0], -1)
        with ui.row().classes("w-full items-center"):
            names = [NOTHING, *regions.values]
            what = ui.select(names, value=plane.name, label="colour a plane by")
            what.props("dense outlined").classes("col").mark("plane-of")
            axes = {k: AXES[k] for k in normals}
            across = ui.select(axes, value=plane.along, label="normal to")
            across.props("dense outlined").classes("w-24").mark("plane-along")
        last = len(regions.axes[plane.along]) - 1
        place = plane.index if plane.index >= 0 else last // 2
        where = ui.slider(min=0, max=last, step=1, value=place)
        where.props('aria-label="place of the plane"').mark("plane-index")
        legend = ui.html("", sanitize=False).classes("w-full").mark("plane-legend")

        def follow() -> None:
            along, is_seen = int(across.value), what.value != NOTHING
            last = len(regions.axes[along]) - 1
            where.props(f"max={last}")
            chosen = Plane(str(what.value), along, min(int(where.value), last))
            legend.content = _legend(regions, chosen) if is_seen else ""
            where.set_visibility(is_seen)
            if (shown := chosen if is_seen else None) != self._view.plane:
                self._view.show_plane(shown)

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
