"""The robot panel: what to do with its file, and all that is in it."""

from __future__ import annotations

from nicegui import events, ui

from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.studio.panels.panel import on_page, show_errors
from cdpr_drake.studio.panels.point_dragging import add_point_dragging
from cdpr_drake.studio.panels.robot_dialogs import (
    export_dialog,
    open_dialog,
    save_dialog,
    save_to,
    text_dialog,
)
from cdpr_drake.studio.panels.schema_tables import SchemaGroups
from cdpr_drake.studio.workbench.session import Workbench

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
    groups = SchemaGroups(bench.robot, Robot, first=FIRST, opened=OPENED, colored=("cables",))

    def refresh() -> None:
        robot = bench.robot.value
        title.text = f"{robot.name}: {robot.title}" if robot.title else robot.name
        state = "" if bench.is_saved else ", with changes that are not saved"
        where.text = f"{bench.file}{state}" if bench.file else "not in a file of the folder yet"
        undo.set_enabled(bench.robot.can_undo)
        redo.set_enabled(bench.robot.can_redo)
        with show_errors():
            groups.refresh()

    def pressed(event: events.KeyEventArguments) -> None:
        if not event.action.keydown or not (event.modifiers.ctrl or event.modifiers.meta):
            return
        name = str(event.key).lower()
        with show_errors():
            if name == "y" or (name == "z" and event.modifiers.shift):
                bench.robot.redo()
            elif name == "z":
                bench.robot.undo()

    ui.keyboard(pressed, ignore=["input", "textarea"])
    add_point_dragging(bench)
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
