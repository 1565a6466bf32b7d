"""The robot panel: what to do with its file, and all that is in it."""

from __future__ import annotations

from html import escape

from nicegui import ui

from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.studio.dragging import add_point_dragging, live_workspace_bar
from cdpr_drake.studio.panel import on_page, show_errors
from cdpr_drake.studio.panels.robot_beside import RobotBeside
from cdpr_drake.studio.panels.robot_dialogs import (
    export_dialog,
    open_dialog,
    save_dialog,
    save_to,
    text_dialog,
)
from cdpr_drake.studio.panels.schema_tables import SchemaGroups
from cdpr_drake.studio.session import Workbench

FIRST = ("cables", "platform", "tension_bounds")
OPENED = ("cables", "tension_bounds")


def robot_panel(bench: Workbench) -> None:
    """Places buttons, title and groups of fields."""
    with ui.row().classes("studio-bar"):
        undo = _tool("undo", "Undo, Ctrl-Z", bench.robot.undo).mark("undo")
        redo = _tool("redo", "Redo, Ctrl-Y", bench.robot.redo).mark("redo")
        _button("Open", "folder_open", lambda: open_dialog(bench)).mark("open")
        _button("Save", "save", lambda: _save(bench)).mark("save")
        _button("Save as", "save_as", lambda: save_dialog(bench)).mark("save-as")
        _button("Export", "file_download", lambda: export_dialog(bench)).mark("export")
        _button("As text", "notes", lambda: text_dialog(bench)).mark("as-text")
    title = ui.label().classes("studio-title").mark("robot-title")
    where = ui.label().classes("studio-soft").mark("robot-file")
    _assumptions(bench)
    live_workspace_bar(bench)
    groups = SchemaGroups(bench.robot, Robot, first=FIRST, opened=OPENED, colored=("cables",))

    def refresh() -> None:
        robot = bench.robot.value
        title.text = f"{robot.name}: {robot.title}" if robot.title else robot.name
        where.text = f"{bench.file}: {bench.state}" if bench.file else _NO_FILE
        undo.set_enabled(bench.robot.can_undo)
        redo.set_enabled(bench.robot.can_redo)
        with show_errors():
            groups.refresh()

    RobotBeside(bench)
    add_point_dragging(bench)
    refresh()
    on_page(bench.robot.changed, refresh)


_NO_FILE = "not in a file of the folder yet; Save as puts it there"


def _assumptions(bench: Workbench) -> None:
    """A card of what was assumed when another tool's file was read, until it is closed."""
    card = ui.element("section").classes("studio-card").mark("assumed")
    card.props('aria-label="What was assumed"')

    def refresh() -> None:
        lines = bench.assumed
        card.set_visibility(bool(lines))
        card.clear()
        with card:
            if lines:
                ui.label("What this robot's file did not say").classes("studio-subtitle")
                items = "".join(f"<li>{escape(line)}</li>" for line in lines)
                ui.html(f"<ul>{items}</ul>", sanitize=False)
                done = ui.button("Seen", icon="check", on_click=bench.forget_assumed)
                done.props("flat dense no-caps").mark("assumed-seen")

    refresh()
    on_page(bench.robot.changed, refresh)


def _save(bench: Workbench) -> None:
    if bench.file:
        save_to(bench, bench.file, overwrite=True)
    else:
        save_dialog(bench)


def _guarded(action: object) -> object:
    def act() -> None:
        with show_errors():
            assert callable(action)
            action()

    return act


def _tool(icon: str, words: str, action: object) -> ui.button:
    made = ui.button(icon=icon, on_click=_guarded(action)).props("flat round dense")  # type: ignore[arg-type]
    return made.props(f'aria-label="{words}" title="{words}"')


def _button(words: str, icon: str, action: object) -> ui.button:
    made = ui.button(words, icon=icon, on_click=_guarded(action))  # type: ignore[arg-type]
    return made.props("flat dense no-caps")
