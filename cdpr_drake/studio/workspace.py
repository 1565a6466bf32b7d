"""The workspace panel: `cdpr workspace` and `cdpr stability`, and their results in the scene."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from typing import Any
from weakref import WeakKeyDictionary, ref

import numpy as np
from nicegui import run, ui

from cdpr_drake.analyses.workspaces.conditions import KINDS, MEASURES
from cdpr_drake.palette import TENSIONS
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
from cdpr_drake.studio.regions import Layer, Plane, Regions, draw_plane, read_regions, show_regions
from cdpr_drake.studio.results import Subject
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.workbench.command_form import FieldProblem
from cdpr_drake.systems.scenarios.files import robot_scenario_names

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
