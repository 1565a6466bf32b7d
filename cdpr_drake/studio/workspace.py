"""The workspace panel: `cdpr workspace` and `cdpr stability`, and their results in the scene."""

from __future__ import annotations

from html import escape
from typing import Any
from weakref import WeakKeyDictionary, ref

import numpy as np
from nicegui import run, ui

from cdpr_drake.palette import TENSIONS
from cdpr_drake.studio.panel import WORKSPACES, show_errors
from cdpr_drake.studio.regions import Layer, Plane, Regions, draw_plane, read_regions, show_regions
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.verb_panel import VerbPanel, VerbTab
from cdpr_drake.studio.views import View

TAB = VerbTab(
    folder="workspaces", result=WORKSPACES, verbs=("workspace", "stability"),
    first={
        "workspace": ("kind", "measure", "grid", "orientation"),
        "stability": ("scheme", "verdict", "grid", "orientation"),
    },
    empty="No workspace yet. Choose what the cables must hold (kind) or what is measured at each "
    "pose (measure), then press Start: the open robot is taken, and the result is drawn in the "
    "scene.",
)  # fmt: skip

AXES = "xyz"
NOTHING = "none"


class RegionView:
    """What a session sees of a workspace that was computed, in all its tabs and in its scene.

    Attributes:
        regions: What was computed; None: nothing is shown.
        visible: Names of the layers that are shown.
        plane: The coloured plane; None: there is none.
    """

    def __init__(self, bench: Workbench) -> None:
        """For a workbench, with nothing in its scene."""
        self._bench = ref(bench)  # which this is kept by
        self.regions: Regions | None = None
        self.visible: set[str] = set()
        self.plane: Plane | None = None
        self._in_scene: Regions | None = None
        bench.results.changed.subscribe(self._follow, unsubscribe_on_delete=False)

    def _fitting(self) -> Regions | None:
        """The regions, if the scene shows the robot that they are of."""
        bench = self._bench()
        about = None if bench is None else bench.results.subject(WORKSPACES)
        if bench is None or about is None or about.is_another(bench.drawn or bench.subject):
            return None
        return self.regions

    @property
    def is_hidden(self) -> bool:
        """True if the scene shows another robot than the one that the regions are of."""
        return self.regions is not None and self._in_scene is None

    def take(self, regions: Regions) -> None:
        """Shows other regions, the first of them."""
        if self.regions is None or regions.folder != self.regions.folder:
            self.plane, self.visible = None, {layer.name for layer in regions.layers[:1]}
        self.regions = regions

    def _follow(self) -> None:
        """Takes workspaces out of the scene of another robot, and puts them back."""
        if self._fitting() is not self._in_scene:
            self._draw_all()

    def _draw_all(self) -> None:
        regions = self._in_scene = self._fitting()
        visible, plane, bench = set(self.visible), self.plane, self._bench()

        def draw(scene: Any) -> None:
            show_regions(scene.meshcat, regions, visible)
            if regions is not None and plane is not None:
                draw_plane(scene.meshcat, regions, plane)

        if bench is not None:
            bench.draw(draw)

    def show_layer(self, name: str, visible: bool) -> None:
        """Shows a layer, or hides it."""
        (self.visible.add if visible else self.visible.discard)(name)
        self._draw_all()

    def show_plane(self, plane: Plane | None) -> None:
        """Puts the coloured plane elsewhere, or takes it away."""
        self.plane, regions, bench = plane, self._in_scene, self._bench()
        if regions is not None and bench is not None:
            bench.draw(lambda scene: draw_plane(scene.meshcat, regions, plane))


_views: WeakKeyDictionary[Workbench, RegionView] = WeakKeyDictionary()
"""What each session sees, as long as it has a workbench."""


def workspace_panel(bench: Workbench) -> None:
    """Places the workspace panel."""
    if bench not in _views:
        _views[bench] = RegionView(bench)
    shown = _views[bench]
    note = ui.label().classes("studio-soft").mark("regions-note")

    def say_hidden() -> None:
        note.set_visibility(shown.is_hidden)
        robot = "" if shown.regions is None else shown.regions.robot
        note.text = f"The workspaces are not in the scene, which does not show that {robot}."

    async def show(view: View) -> None:
        assert view.folder is not None
        with show_errors():
            regions = await run.io_bound(read_regions, view.folder)
            if regions is not None:  # the server is not ending
                shown.take(regions)
                _place_layers(regions, shown)
                _place_plane(regions, shown)
        view.place()

    VerbPanel(bench, TAB, show=show)
    say_hidden()
    bench.results.changed.subscribe(say_hidden)


def _place_layers(regions: Regions, shown: RegionView) -> None:
    with ui.element("table").classes("studio-facts").props('aria-label="Workspaces"'):
        with ui.element("thead"), ui.element("tr"):
            for words in ("shown", "workspace", "share", "volume"):
                with ui.element("th"):
                    ui.label(words)
        with ui.element("tbody"):
            for layer in regions.layers:
                with ui.element("tr"):
                    _place_layer(layer, shown)


def _place_layer(layer: Layer, shown: RegionView) -> None:
    name, color = escape(layer.name), layer.color
    shade = ",".join(str(round(255 * part)) for part in (color.r(), color.g(), color.b()))
    swatch = f'<span class="studio-swatch" style="display:inline-block;background:rgb({shade})">'
    with ui.element("td"):
        box = ui.switch(value=layer.name in shown.visible)
        box.props(f'dense aria-label="show {name}"').mark(f"layer-{layer.name}")
        box.set_enabled(layer.solid is not None)
        box.on_value_change(lambda event: shown.show_layer(layer.name, bool(event.value)))
    with ui.element("th"):
        ui.html(f"{swatch}</span> {name}: {escape(layer.title)}", sanitize=False)
    with ui.element("td"):
        ui.label("–" if layer.share is None else f"{100.0 * layer.share:.2f} %")
    with ui.element("td"):
        words = "–" if layer.volume is None else f"{layer.volume:.4g} {layer.unit}"
        ui.label(words).mark(f"volume-{layer.name}")


def _place_plane(regions: Regions, shown: RegionView) -> None:
    """A plane across the grid, coloured by a measure."""
    normals = regions.normals()
    if not regions.values or not normals:
        return
    plane = shown.plane or Plane(NOTHING, 2 if 2 in normals else normals[0], -1)
    with ui.row().classes("w-full items-center"):
        names = [NOTHING, *regions.values]
        what = ui.select(names, value=plane.name, label="colour a plane by")
        what.props("dense outlined").classes("col").mark("plane-of")
        axes = {k: AXES[k] for k in normals}
        across = ui.select(axes, value=plane.along, label="normal to")
        across.props("dense outlined").classes("w-24").mark("plane-along")
    last = len(regions.axes[plane.along]) - 1
    where = ui.slider(min=0, max=last, value=plane.index if plane.index >= 0 else last // 2)
    where.props('aria-label="place of the plane"').mark("plane-index")
    legend = ui.html("", sanitize=False).classes("w-full").mark("plane-legend")

    def follow() -> None:
        along, is_seen = int(across.value), what.value != NOTHING
        last = len(regions.axes[along]) - 1
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
