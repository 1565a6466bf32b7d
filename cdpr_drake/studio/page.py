"""The page: header with tabs, panels, and beside them the scene.

The panel that is shown is part of the page. What panels import takes longer than all else of a
start, so the others come behind it: once the browser is there, their modules are imported in the
calculator's thread, before it computes anything, and they are placed one after the other, the tab
that was opened meanwhile first.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from fastapi import Request
from nicegui import events, ui

from cdpr_drake.palette import COLORS, SLACK
from cdpr_drake.studio.door import BENCH
from cdpr_drake.studio.panel import PANELS, place_remarks, say_errors, show_errors
from cdpr_drake.studio.session import Workbench

SCENE = "/scene/"
"""Where the server relays the scene of a session to."""

PREFERS_DARK = "return window.matchMedia('(prefers-color-scheme: dark)').matches"

PALETTE = {f"--studio-color-{k}": color for k, color in enumerate(COLORS)}
PALETTE["--studio-slack"] = SLACK
"""The package's colours, by their names in style sheets."""

STYLE = "".join(f":root {{ {name}: {color}; }}\n" for name, color in PALETTE.items())
STYLE += (Path(__file__).parent / "studio.css").read_text(encoding="utf-8")

BETWEEN = 0.02
"""Between two panels that are placed, for what the browser asks meanwhile [s]."""


def make_page(
    bench_of: Callable[[Request], Workbench] = lambda request: request.scope[BENCH],
) -> Callable[[], None]:
    """The function that builds a page, for the workbench of its request."""

    def page() -> None:
        ui.add_css(STYLE)
        say_errors()
        bench = bench_of(ui.context.client.request)
        ui.keyboard(lambda event: _press(bench, event), ignore=["input", "textarea"])
        with ui.header().classes("studio-header"):
            name = ui.label("cdpr studio").classes("studio-name")
            name.props('role="heading" aria-level="1"')
            with ui.tabs() as tabs:
                tabs.props("dense inline-label mobile-arrows outside-arrows no-caps")
                for key, panel in PANELS.items():
                    ui.tab(key, label=panel.title, icon=panel.icon).mark(f"tab-{key}")
            _place_state(bench)
            _place_dark_button(bench)
        with ui.element("div").classes("studio-main"):
            _place_panels(bench, tabs)
            # After the panels: keys get into the scene's own controls, which are many.
            with ui.element("section").classes("studio-scene").props('aria-label="Scene"'):
                ui.element("iframe").props(f'src="{SCENE}" title="The robot in space" id="scene"')

    return page


def _place_dark_button(bench: Workbench) -> None:
    dark = ui.dark_mode(value=bench.dark)

    def show(is_dark: bool) -> None:
        bench.dark = dark.value = is_dark
        bench.draw(lambda scene: scene.set_dark(is_dark))

    async def ask() -> None:
        if bench.dark is None:
            with suppress(TimeoutError):  # a browser that is gone already
                show(bool(await ui.run_javascript(PREFERS_DARK, timeout=10.0)))

    async def turn_over() -> None:
        await ask()  # a click may come before the answer
        show(not bench.dark)

    turn = ui.button(icon="contrast", on_click=turn_over).mark("dark-or-light")
    turn.props('flat round dense color=white aria-label="Dark or light" title="Dark or light"')
    ui.context.client.on_connect(ask)


def _place_state(bench: Workbench) -> None:
    """Says in every tab that a job works, which robot is open, whether it is saved, what it is."""
    sign = ui.row().classes("studio-busy").props('role="status"').mark("job-at-work")
    with sign:
        ui.spinner(size="1.1rem", color="white")
        ui.label("job at work")
    sign.bind_visibility_from(bench.jobs, "is_busy")
    with ui.element("div").classes("studio-subject").props('role="status"'):
        name = ui.label().classes("studio-subject-name").mark("subject-name")
        state = ui.label().classes("studio-state").mark("subject-state")
        print_ = ui.label().classes("studio-print").mark("subject-fingerprint")
        print_.props('title="Fingerprint of the robot; results carry that of theirs"')

    def refresh() -> None:
        name.text, state.text = bench.robot.value.name, bench.state
        print_.text = bench.subject.fingerprint
        name.props["title"] = bench.file or bench.robot.value.title

    refresh()
    bench.robot.changed.subscribe(refresh)


def _press(bench: Workbench, event: events.KeyEventArguments) -> None:
    """Ctrl-Z, Ctrl-Y and Ctrl-Shift-Z in every tab, but in fields, which have their own."""
    key = str(event.key).lower()
    is_control = event.modifiers.ctrl or event.modifiers.meta
    if event.action.keydown and is_control and key in ("y", "z"):
        is_undo = key == "z" and not event.modifiers.shift
        (bench.robot.undo if is_undo else bench.robot.redo)()


def _place_panels(bench: Workbench, tabs: ui.tabs) -> None:
    """Places the panel that was shown last, and the others once the browser is there."""
    client, waiting = ui.context.client, dict[str, ui.tab_panel]()
    shown = bench.panel if bench.panel in PANELS else next(iter(PANELS))

    def place(name: str) -> None:
        if name in waiting and not client.is_deleted:
            with waiting.pop(name).clear(), show_errors():
                place_remarks(bench, PANELS[name])
                PANELS[name].load()(bench)

    def load() -> None:
        """Imports and reads what panels need; they say what is wrong when they are placed."""
        from cdpr_drake.systems.scenarios.files import robot_scenario_names

        robot_scenario_names()
        for panel in PANELS.values():
            with suppress(Exception):
                panel.load()
        with suppress(Exception):
            _ = bench.commands

    async def place_rest() -> None:
        if waiting:  # not a browser that comes back
            future = bench.calculator.submit(load)
            _ = bench.scene_address  # the robot is drawn there before anything is known of it
            bench.ask()
            await asyncio.wrap_future(future)
            for name in (bench.panel, *PANELS):
                place(name)
                await asyncio.sleep(BETWEEN)

    def turn_to() -> None:
        bench.panel = str(pages.value)

    with ui.tab_panels(tabs, value=shown, animated=False, on_change=turn_to) as pages:
        pages.classes("studio-panels")
        for name, panel in PANELS.items():
            with ui.tab_panel(name) as waiting[name]:
                words = ui.label(f"{panel.title}: loading").classes("studio-empty")
                words.props('role="status"').mark("panel-loading")
    place(shown)
    client.on_connect(place_rest)
