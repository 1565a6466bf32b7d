"""The page: header with tabs, panels, and beside them the scene.

The panel that is shown is part of the page. What panels import takes longer than all else of a
start, so the others come behind it: once the browser is there, their modules are imported in the
calculator's thread, before it computes anything, and they are placed one after the other. A tab
that is opened before says that it is loaded, and is the next one.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from pathlib import Path

from fastapi import Request
from nicegui import background_tasks, events, ui

from cdpr_drake.palette import COLORS, SLACK
from cdpr_drake.studio.door import SESSION
from cdpr_drake.studio.panel import PANELS, message, on_page, place_remarks, show_errors
from cdpr_drake.studio.scene_relay import SCENE
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.sessions import Sessions

PREFERS_DARK = "return window.matchMedia('(prefers-color-scheme: dark)').matches"

LANGUAGE = '<script>document.documentElement.lang = "en"</script>'
"""Programs that read pages aloud choose a voice by it."""

PALETTE = {f"--studio-color-{k}": color for k, color in enumerate(COLORS)} | {
    "--studio-slack": SLACK
}
"""The package's colours, by their names in style sheets."""

STYLE = (
    ":root { " + " ".join(f"{name}: {color};" for name, color in PALETTE.items()) + " }\n"
    + (Path(__file__).parent / "studio.css").read_text(encoding="utf-8")
)  # fmt: skip

BETWEEN = 0.02
"""Between two panels that are placed, for what the browser asks meanwhile [s]."""

WORK_TICK = 0.2
"""Between two looks whether a job works [s]."""


def session_of(request: Request) -> str:
    """The session of a request that the door has let through."""
    return str(request.scope[SESSION])


def make_page(
    sessions: Sessions, session_of: Callable[[Request], str] = session_of
) -> Callable[[], None]:
    """The function that builds the page of a session, which `session_of` tells of a request."""

    def page() -> None:
        ui.page_title("cdpr studio")
        ui.add_css(STYLE)
        ui.add_head_html(LANGUAGE)
        session = session_of(ui.context.client.request)
        try:
            bench = sessions.open_page(session)
        except Exception as problem:
            ui.label(message(problem)).classes("studio-problem")
            return
        ui.context.client.on_delete(lambda: sessions.close_page(session))
        _build(bench)

    return page


def _build(bench: Workbench) -> None:
    dark = ui.dark_mode(value=bench.dark)
    shown = bench.panel if bench.panel in PANELS else next(iter(PANELS))
    with ui.header().classes("studio-header"):
        name = ui.label("cdpr studio").classes("studio-name")
        name.props('role="heading" aria-level="1"')
        with ui.tabs() as tabs:
            tabs.props("dense inline-label mobile-arrows outside-arrows no-caps")
            for key, panel in PANELS.items():
                ui.tab(key, label=panel.title, icon=panel.icon).mark(f"tab-{key}")
        _place_work_sign(bench)
        _place_subject(bench)
        turn = ui.button(icon="contrast").props("flat round dense color=white")
        turn.mark("dark-or-light").props('aria-label="Dark or light" title="Dark or light"')

    async def ask_for_dark() -> None:
        if bench.dark is None:
            with suppress(TimeoutError):  # a browser that is gone already
                show(bool(await ui.run_javascript(PREFERS_DARK, timeout=10.0)))

    async def turn_over() -> None:
        await ask_for_dark()  # a click may come before the answer
        show(not bench.dark)

    def show(is_dark: bool) -> None:
        bench.dark = dark.value = is_dark
        bench.draw(lambda scene: scene.set_dark(is_dark))

    ui.keyboard(lambda event: _pressed(bench, event), ignore=["input", "textarea"])
    with ui.element("div").classes("studio-main"):
        pages = PanelPages(bench, tabs, shown)
        # After the panels: keys get into the scene's own controls, which are many.
        with ui.element("section").classes("studio-scene").props('aria-label="Scene"'):
            ui.element("iframe").props(f'src="{SCENE}" title="The robot in space" id="scene"')
    turn.on_click(turn_over)
    ui.context.client.on_connect(pages.begin)
    ui.context.client.on_connect(ask_for_dark)


def _place_work_sign(bench: Workbench) -> None:
    """Says in every tab that a job of the server works, whoever has begun it."""
    sign = ui.row().classes("studio-busy").props('role="status"').mark("job-at-work")
    with sign:
        ui.spinner(size="1.1rem", color="white")
        ui.label("job at work")
    sign.visible = False
    ui.timer(WORK_TICK, lambda: sign.set_visibility(bench.jobs.is_busy))


def _place_subject(bench: Workbench) -> None:
    """Says in every tab which robot is open, whether it is saved, and its fingerprint."""
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
    on_page(bench.robot.changed, refresh)


def _pressed(bench: Workbench, event: events.KeyEventArguments) -> None:
    """Ctrl-Z, Ctrl-Y and Ctrl-Shift-Z in every tab, but in fields, which have their own."""
    if not event.action.keydown or not (event.modifiers.ctrl or event.modifiers.meta):
        return
    key = str(event.key).lower()
    with show_errors():
        if key == "y" or (key == "z" and event.modifiers.shift):
            bench.robot.redo()
        elif key == "z":
            bench.robot.undo()


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
        if self._loaded is None:
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
        if name not in self._built:
            self._built.add(name)
            self._places[name].clear()
            with self._places[name], show_errors():
                place_remarks(self._bench, PANELS[name])
                PANELS[name].load()(self._bench)

    async def _open(self, name: str) -> None:
        self._bench.panel = name
        await self._place(name)
