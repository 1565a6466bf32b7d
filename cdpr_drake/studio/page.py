"""The page: header with tabs, panels, and beside them the scene.

`STYLE` is how it looks, beside Quasar: the layout, which is narrow on a phone, and its colours.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

from fastapi import Request
from nicegui import events, ui

from cdpr_drake.palette import COLORS, SLACK
from cdpr_drake.studio.guard import SESSION
from cdpr_drake.studio.panel_pages import PanelPages
from cdpr_drake.studio.panels.panel import message, on_page, show_errors
from cdpr_drake.studio.panels.table import PANELS
from cdpr_drake.studio.scene_relay import SCENE
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.sessions import Sessions

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
            for panel in PANELS.values():
                ui.tab(panel.name, label=panel.title, icon=panel.icon).mark(f"tab-{panel.name}")
        _place_subject(bench)
        turn = ui.button(icon="contrast").props("flat round dense color=white")
        turn.mark("dark-or-light").props('aria-label="Dark or light" title="Dark or light"')

    def show(is_dark: bool) -> None:
        bench.dark = is_dark
        dark.value = is_dark
        bench.draw(lambda scene: scene.set_dark(is_dark))

    _undo_by_keys(bench)
    with ui.element("div").classes("studio-main"):
        pages = PanelPages(bench, tabs, shown)
        # After the panels: keys get into the scene's own controls, which are many.
        with ui.element("section").classes("studio-scene").props('aria-label="Scene"'):
            ui.element("iframe").props(f'src="{SCENE}" title="The robot in space" id="scene"')

    async def ask_for_dark() -> None:
        if bench.dark is None:
            with suppress(TimeoutError):  # a browser that is gone already
                show(bool(await ui.run_javascript(PREFERS_DARK, timeout=10.0)))

    async def turn_over() -> None:
        await ask_for_dark()  # a click may come before the answer
        show(not bench.dark)

    turn.on_click(turn_over)
    ui.context.client.on_connect(pages.begin)
    ui.context.client.on_connect(ask_for_dark)


def _place_subject(bench: Workbench) -> None:
    """Says in every tab which robot is open, whether it is saved, and its fingerprint."""
    with ui.element("div").classes("studio-subject").props('role="status"'):
        name = ui.label().classes("studio-subject-name").mark("subject-name")
        state = ui.label().classes("studio-state").mark("subject-state")
        print_ = ui.label().classes("studio-print").mark("subject-fingerprint")

    def refresh() -> None:
        name.text, state.text = bench.robot.value.name, bench.state
        print_.text = bench.subject.fingerprint
        name.props["title"] = bench.file or bench.robot.value.title
        print_.props["title"] = "Fingerprint of the robot; results carry that of theirs"

    refresh()
    on_page(bench.robot.changed, refresh)


def _undo_by_keys(bench: Workbench) -> None:
    """Ctrl-Z, Ctrl-Y and Ctrl-Shift-Z in every tab, but in fields, which have their own."""

    def pressed(event: events.KeyEventArguments) -> None:
        if not event.action.keydown or not (event.modifiers.ctrl or event.modifiers.meta):
            return
        key = str(event.key).lower()
        with show_errors():
            if key == "y" or (key == "z" and event.modifiers.shift):
                bench.robot.redo()
            elif key == "z":
                bench.robot.undo()

    ui.keyboard(pressed, ignore=["input", "textarea"])


LANGUAGE = '<script>document.documentElement.lang = "en"</script>'
"""Programs that read pages aloud choose a voice by it."""

STYLE = f"""
:root {{ --studio-line: #c8ccd2; --studio-soft: #5a6068; --studio-problem: {SLACK};
  --studio-track: #e6e9ed; }}
body {{ --q-primary: {COLORS[0]} !important; }}
body.body--dark {{ --q-primary: {COLORS[4]} !important;
  --studio-line: #43484f; --studio-soft: #a9b0b8; --studio-problem: #ff7b72;
  --studio-track: #969ca3; }}
body.body--dark .bg-primary .q-btn__content {{ color: #101418; }}
.body--dark .studio-panels, .body--dark .q-menu, .body--dark .q-dialog {{ color-scheme: dark; }}
.nicegui-content {{ padding: 0 !important; }}
.studio-header {{ padding: 0 0.8rem; gap: 0.6rem; align-items: center; flex-wrap: nowrap;
  min-height: 2.8rem; background: #24476b !important; }}
.studio-name {{ font-weight: 600; white-space: nowrap; }}
.studio-header .q-tabs {{ flex: 0 1 auto; min-width: 0; }}
.studio-subject {{ flex: 1 1 auto; min-width: 0; display: flex; gap: 0.5rem; align-items: center;
  justify-content: flex-end; white-space: nowrap; font-size: 0.86rem; }}
.studio-subject-name {{ font-weight: 600; overflow: hidden; text-overflow: ellipsis; }}
.studio-state {{ border: 1px solid #ffffff; border-radius: 0.7rem; padding: 0 0.5rem; }}
.studio-print {{ font-family: monospace; }}
.q-chip .q-chip__icon {{ color: inherit; opacity: 1; }}
:focus-visible {{ box-shadow: 0 0 0 3px #e08a00 !important; }}
.studio-header :focus-visible {{ box-shadow: inset 0 0 0 3px #ffffff !important; }}
.q-field--focused:has(:focus-visible) .q-field__control {{
  outline: 3px solid #e08a00; outline-offset: -1px; }}
.q-field--focused :focus-visible, .q-field__control :focus-visible {{
  box-shadow: none !important; }}
.studio-empty {{ border: 1px dashed var(--studio-line); padding: 0.6rem 0.8rem; width: 100%;
  color: var(--studio-soft); }}
.studio-card {{ border: 1px solid var(--studio-line); border-left: 4px solid {COLORS[1]};
  padding: 0.4rem 0.8rem; width: 100%; font-size: 0.9rem; }}
.studio-card ul {{ margin: 0.2rem 0; padding-left: 1.1rem; overflow-wrap: anywhere; }}
.studio-live {{ width: 100%; font-size: 0.86rem; min-height: 4.4rem;
  font-variant-numeric: tabular-nums; }}
.studio-main {{ display: grid; grid-template-columns: minmax(0, 1.2fr) minmax(0, 1fr);
  width: 100%;
  height: calc(100vh - 2.8rem); }}
.studio-scene {{ order: 2; border-left: 1px solid var(--studio-line); }}
.studio-scene iframe {{ width: 100%; height: 100%; border: 0; display: block; }}
.studio-panels {{ order: 1; overflow: auto; background: transparent; }}
.studio-problem {{ color: var(--studio-problem); white-space: pre-line; padding: 1rem; }}
.studio-notice .q-notification__message {{ white-space: pre-line; overflow-wrap: anywhere; }}
.studio-panels .q-tab-panel {{ padding: 0.6rem 0.8rem; gap: 0.35rem; }}
.studio-group .q-item {{ padding: 0.2rem 0.2rem; }}
.studio-form .q-field__suffix, .studio-number .q-field__suffix {{ padding: 0; line-height: 2rem; }}
.q-field__messages {{ line-height: 1.3; }}
.studio-stale {{ color: var(--studio-problem); font-size: 0.86rem; min-height: 1.3rem; }}
.studio-stale:empty:not(.studio-kept) {{ display: none; }}
.studio-soft {{ color: var(--studio-soft); }}
.studio-stale.studio-soft {{ color: var(--studio-soft); }}
.studio-fingerprint {{ color: var(--studio-soft); font-size: 0.8rem; }}
.studio-fingerprint:empty {{ display: none; }}
.studio-row {{ width: 100%; gap: 0.6rem; flex-wrap: wrap; margin: 0.4rem 0; }}
.studio-sliders {{ display: grid; width: 100%; grid-template-columns: 1.2rem minmax(0, 1fr) 8.2rem;
  gap: 0.15rem 0.8rem; align-items: center; }}
.studio-axis {{ font-weight: 600; text-align: right; }}
.studio-cables, .studio-facts {{ width: 100%; border-collapse: collapse; font-size: 0.86rem;
  font-variant-numeric: tabular-nums; margin: 0.4rem 0; }}
.studio-cables th, .studio-cables td, .studio-facts th, .studio-facts td {{
  padding: 0.16rem 0.5rem; text-align: right; border-bottom: 1px solid var(--studio-line); }}
.studio-cables thead th {{ font-weight: 500; color: var(--studio-soft); }}
.studio-cables th:first-child, .studio-cables th:nth-child(2), .studio-facts th,
.studio-facts td {{ text-align: left; }}
.studio-facts th {{ font-weight: 500; color: var(--studio-soft); white-space: nowrap; }}
.studio-facts td {{ overflow-wrap: anywhere; }}
.studio-wide {{ overflow-x: auto; width: 100%; }}
.studio-wide td {{ overflow-wrap: normal; }}
.studio-cables .swatch {{ display: inline-block; width: 0.75rem; height: 0.75rem;
  border-radius: 50%; margin-right: 0.4rem; vertical-align: -1px;
  outline: 1px solid var(--studio-line); }}
.studio-cables th {{ white-space: nowrap; }}
.studio-cables thead th {{ white-space: normal; }}
.studio-cables td.bar {{ width: 34%; padding-right: 0; }}
.studio-cables td.bar div {{ position: relative; height: 0.85rem;
  background: var(--studio-track); }}
.studio-cables td.bar b {{ position: absolute; left: 0; top: 0; height: 100%; min-width: 2px; }}
.body--dark .studio-swatch, .body--dark .studio-cables .swatch,
.body--dark .studio-cables td.bar b {{ outline: 1px solid #b4bac1; }}
.studio-cables caption {{ text-align: left; color: var(--studio-soft); padding: 0.2rem 0.5rem; }}
.studio-cables td.bar .tick {{ position: absolute; top: -2px; bottom: -2px; width: 2px;
  background: currentColor; }}
.studio-cables tr.slack td, .studio-cables tr.slack th {{ color: var(--studio-problem);
  font-weight: 600; }}
.studio-form {{ display: grid; grid-template-columns: 11rem minmax(0, 1fr);
  gap: 0.2rem 0.8rem; align-items: center; width: 100%; }}
.studio-label {{ color: var(--studio-soft); }}
.studio-parts {{ display: flex; gap: 0.25rem; min-width: 0; }}
.studio-field {{ width: 100%; max-width: 26rem; }}
.studio-named .q-field__label {{ display: none; }}
.studio-named .q-field__control-container {{ padding-top: 0 !important; }}
.studio-cell {{ flex: 1; min-width: 0; max-width: 9rem; }}
.studio-cell .q-field__control, .studio-table .studio-field .q-field__control {{
  padding: 0 0.4rem; }}
.studio-form .q-field--dense .q-field__control, .studio-table .q-field--dense .q-field__control,
.studio-number .q-field__control, .studio-form .q-field--dense .q-field__marginal,
.studio-table .q-field--dense .q-field__marginal, .studio-number .q-field__marginal {{
  height: 2rem; min-height: 2rem; font-size: 0.86rem; }}
.studio-form .q-field__native, .studio-table .q-field__native, .studio-number .q-field__native {{
  min-height: 2rem; padding: 0; font-variant-numeric: tabular-nums; }}
.studio-field-problem, .studio-row-problem {{ grid-column: 1 / -1; white-space: pre-line;
  color: var(--studio-problem); font-size: 0.82rem; overflow-wrap: anywhere; }}
.studio-group {{ border-bottom: 1px solid var(--studio-line); }}
.studio-group .q-expansion-item__content {{ padding: 0.1rem 0.2rem 0.5rem;
  gap: 0.3rem; }}
.studio-subtitle {{ font-weight: 600; margin-top: 0.5rem; }}
.studio-inner {{ padding-left: 0.8rem; border-left: 2px solid var(--studio-line); width: 100%; }}
.studio-table {{ display: grid; gap: 0.2rem 0.5rem; align-items: center; width: 100%; }}
.studio-head {{ color: var(--studio-soft); font-size: 0.82rem; }}
.studio-swatch {{ width: 0.8rem; height: 0.8rem; border-radius: 50%;
  outline: 1px solid var(--studio-line); }}
.studio-tools {{ gap: 0; flex-wrap: nowrap; }}
.studio-bar {{ width: 100%; gap: 0.15rem; align-items: center; padding: 0.2rem 0 0.4rem; }}
.studio-title {{ font-weight: 600; overflow-wrap: anywhere; }}
.studio-dialog {{ width: min(46rem, 94vw); max-width: 94vw; }}
.studio-drop {{ width: 100%; }}
@media (min-width: 1700px) {{
  .studio-main {{ grid-template-columns: minmax(0, 860px) minmax(0, 1fr); }}
}}
@media (max-width: 860px) {{
  .studio-main {{ display: flex; flex-direction: column; height: auto; }}
  .studio-panels {{ order: 2; }}
  .studio-scene {{ order: 1; height: 38vh; border-left: 0;
    border-bottom: 1px solid var(--studio-line); }}
  .studio-header {{ flex-wrap: wrap; padding: 0.1rem 0.4rem 0; row-gap: 0; }}
  .studio-header .q-tabs {{ order: 3; flex: 1 1 100%; }}
  .studio-header .q-tab {{ padding: 0; min-width: 0; flex: 1 1 0; }}
  .studio-header .q-tab__content {{ flex-direction: column; min-width: 0; padding: 0.15rem 0; }}
  .studio-header .q-tab__icon {{ font-size: 1.15rem; width: auto; height: auto; }}
  .studio-header .q-tab__label {{ padding: 0; margin: 0; font-size: 0.7rem; line-height: 1rem; }}
  .studio-name {{ position: absolute; clip-path: inset(50%); width: 1px; height: 1px;
    overflow: hidden; }}
  .studio-subject {{ justify-content: flex-start; }}
  .studio-form {{ grid-template-columns: minmax(0, 1fr); }}
  .studio-table {{ overflow-x: auto; }}
  .studio-cables th, .studio-cables td, .studio-facts th, .studio-facts td {{
    padding: 0.16rem 0.25rem; }}
  .studio-facts th {{ white-space: normal; }}
}}
"""
