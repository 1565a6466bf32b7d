"""The page: header with tabs, panels, and beside them the scene."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

from fastapi import Request
from nicegui import ui

from cdpr_drake.studio.guard import SESSION
from cdpr_drake.studio.look import STYLE
from cdpr_drake.studio.panels import PANELS, place_remarks
from cdpr_drake.studio.scene_relay import SCENE
from cdpr_drake.studio.sessions import Sessions
from cdpr_drake.studio.widgets import message, quietly
from cdpr_drake.studio.workbench import Workbench

PREFERS_DARK = "return window.matchMedia('(prefers-color-scheme: dark)').matches"


def session_of(request: Request) -> str:
    """The session of a request that the guard has let through."""
    return str(request.scope[SESSION])


def make_page(
    sessions: Sessions, session_of: Callable[[Request], str] = session_of
) -> Callable[[], None]:
    """The function that builds the page of a session, which `session_of` tells of a request."""

    def page() -> None:
        ui.page_title("cdpr studio")
        ui.add_css(STYLE)
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
    bench.scene_address()
    bench.ask()
    dark = ui.dark_mode(value=bench.dark)
    shown = bench.panel if bench.panel in PANELS else next(iter(PANELS))
    with ui.header().classes("studio-header"):
        ui.label("cdpr studio").classes("studio-name")
        with ui.tabs() as tabs:
            tabs.props("dense inline-label mobile-arrows outside-arrows no-caps")
            for panel in PANELS.values():
                ui.tab(panel.name, label=panel.title, icon=panel.icon).mark(f"tab-{panel.name}")
        ui.space()
        turn = ui.button(icon="contrast").props("flat round dense color=white")
        turn.props('aria-label="Dark or light" title="Dark or light"')

    def show(is_dark: bool) -> None:
        bench.dark = is_dark
        dark.value = is_dark
        bench.draw(lambda scene: scene.set_dark(is_dark))

    turn.on_click(lambda: show(not bench.dark))
    with ui.element("main").classes("studio-main"):
        with ui.element("section").classes("studio-scene").props('aria-label="Scene"'):
            ui.element("iframe").props(f'src="{SCENE}" title="The robot in space" id="scene"')
        with ui.tab_panels(tabs, value=shown, animated=False) as pages:
            pages.classes("studio-panels").on_value_change(
                lambda event: setattr(bench, "panel", event.value)
            )
            for panel in PANELS.values():
                with ui.tab_panel(panel.name), quietly():
                    place_remarks(bench, panel)
                    panel.build(bench)

    async def ask_for_dark() -> None:
        if bench.dark is None:
            with suppress(TimeoutError):  # a browser that is gone already
                show(bool(await ui.run_javascript(PREFERS_DARK, timeout=10.0)))

    ui.context.client.on_connect(ask_for_dark)
