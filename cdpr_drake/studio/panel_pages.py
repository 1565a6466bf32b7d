"""The panels in the page: the one that is shown is part of the page, the others come behind it.

What panels import takes longer than all else of a start. So the page goes out with one panel. Once
the browser is there, the modules of the others are imported in the calculator's thread, before it
computes anything, and the panels are placed one after the other. A tab that is opened before says
that it is loaded, and is the next one.
"""

from __future__ import annotations

import asyncio
from concurrent.futures import Future
from contextlib import suppress

from nicegui import background_tasks, ui

from cdpr_drake.studio.panels.panel import place_remarks, show_errors
from cdpr_drake.studio.panels.table import PANELS
from cdpr_drake.studio.session import Workbench

BETWEEN = 0.02
"""Between two panels that are placed, for what the browser asks meanwhile [s]."""


class PanelPages:
    """The panels of one page."""

    def __init__(self, bench: Workbench, tabs: ui.tabs, shown: str) -> None:
        """Places them into the current slot, the one that is `shown` with all that it has."""
        self._bench, self._client = bench, ui.context.client
        self._places: dict[str, ui.tab_panel] = {}
        self._built: set[str] = set()
        self._loaded: Future[None] | None = None
        with ui.tab_panels(tabs, value=shown, animated=False) as pages:
            for name, panel in PANELS.items():
                with ui.tab_panel(name) as self._places[name]:
                    if name != shown:
                        words = ui.label(f"{panel.title}: loading").classes("studio-empty")
                        words.props('role="status"').mark("panel-loading")
        self._build(shown)
        pages.classes("studio-panels").on_value_change(lambda event: self._open(event.value))

    def begin(self) -> None:
        """Loads and places the other panels, has the robot drawn, and asks what is known about it.

        To be called when the browser is there; a browser that comes back changes nothing.
        """
        if self._loaded is not None:
            return
        self._loaded = self._bench.calculator.submit(self._load)
        background_tasks.create(self._place_rest(), name="panels")
        self._bench.scene_address()
        self._bench.ask()

    def _load(self) -> None:
        """Imports and reads what panels need; in the calculator's thread."""
        from cdpr_drake.systems.scenarios.files import robot_scenario_names

        robot_scenario_names()  # read once, for the panels that offer them
        for panel in PANELS.values():
            with suppress(Exception):  # said in its place, when it is built
                panel.load()
        with suppress(Exception):  # said by the panels that have forms of commands
            _ = self._bench.commands

    async def _place_rest(self) -> None:
        for name in PANELS:
            await self._place(name)
            await asyncio.sleep(BETWEEN)

    async def _place(self, name: str) -> None:
        if self._loaded is not None:
            await asyncio.wrap_future(self._loaded)
        if not self._client.is_deleted:
            self._build(name)

    def _build(self, name: str) -> None:
        """Places a panel, unless it is there."""
        if name in self._built:
            return
        self._built.add(name)
        place, panel = self._places[name], PANELS[name]
        place.clear()
        with place, show_errors():
            place_remarks(self._bench, panel)
            panel.build(self._bench)

    async def _open(self, name: str) -> None:
        self._bench.panel = name
        await self._place(name)
