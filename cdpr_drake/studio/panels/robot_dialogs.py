"""Dialogs about a robot's file: open and upload, save, export, the text itself."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from nicegui import events, run, ui

from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_loader import robot_names
from cdpr_drake.studio.panel import message, notify, show_errors
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.workbench.robot_files import (
    LARGEST_UPLOAD,
    MOST_UPLOADS,
    UPLOADS,
    OpenedRobot,
    export_formats,
    exported,
)


@contextmanager
def _dialog(title: str) -> Iterator[Any]:
    """A dialog that is gone for good when it is closed."""
    with ui.dialog() as dialog, ui.card().classes("studio-dialog"):
        ui.label(title).classes("studio-subtitle")
        yield dialog
    dialog.on_value_change(lambda: None if dialog.value else dialog.delete())
    dialog.open()


def _problem_label() -> Any:
    return ui.label().classes("studio-field-problem").props('role="alert"').mark("dialog-problem")


def _attempt(said: Any, action: Callable[[], None]) -> bool:
    """Whether an action was done; a label says why not."""
    said.text = ""
    try:
        action()
    except (CdprError, OSError) as problem:
        said.text = message(problem)
        return False
    return True


async def _attempt_reading(
    said: Any, read: Callable[[], OpenedRobot], take: Callable[[OpenedRobot], OpenedRobot]
) -> bool:
    """As `_attempt` of what another thread reads: the server answers others meanwhile."""
    said.text = ""
    try:
        opened = await run.io_bound(read)
        if opened is not None:  # the server is not ending
            tell_opened(take(opened))
    except (CdprError, OSError) as problem:
        said.text = message(problem)
        return False
    return True


def tell_opened(opened: OpenedRobot) -> None:
    """Says that a robot comes from another tool's file; a card has what was assumed."""
    if opened.notes:
        notify(opened.notes[0], "info")


def open_dialog(bench: Workbench) -> None:
    """Chooses a robot of the package, a file of the folder, or files of this computer."""
    with _dialog("Open a robot") as dialog:
        said = _problem_label()

        async def take(name: Any) -> None:
            with show_errors():
                read = lambda: bench.files.open(str(name))  # noqa: E731
                if name and await _attempt_reading(said, read, bench.take_opened):
                    dialog.close()

        chosen = ui.select(list(robot_names()), label="Robot of the package", with_input=True)
        chosen.props("dense outlined").classes("w-full").mark("open-robot")
        chosen.on_value_change(lambda: take(chosen.value))
        files = bench.folder.files(UPLOADS)
        file = ui.select(files, label=f"File in {bench.folder.root}", with_input=True)
        file.props("dense outlined").classes("w-full").mark("open-file")
        file.on_value_change(lambda: take(file.value))

        async def receive(event: events.MultiUploadEventArguments) -> None:
            content = {one.name: await one.read() for one in event.files}

            with show_errors():
                read = lambda: bench.files.upload(content)  # noqa: E731
                if await _attempt_reading(said, read, bench.take_upload):
                    dialog.close()
                else:
                    upload.reset()

        upload = ui.upload(
            label="Drop files here: robot.yaml, or those of another tool",
            multiple=True, auto_upload=True, max_file_size=LARGEST_UPLOAD, max_files=MOST_UPLOADS,
            on_multi_upload=receive,
            on_rejected=lambda: said.set_text(
                f"found a file that is too large, or too many; accepted: up to {MOST_UPLOADS} "
                f"files of at most {LARGEST_UPLOAD:,} bytes"
            ),
        )  # fmt: skip
        upload.classes("studio-drop").props("flat bordered").mark("upload")
        ui.label("Read: " + ", ".join(UPLOADS)).classes("studio-soft")
        ui.button("Close", on_click=dialog.close).props("flat no-caps")


def save_to(bench: Workbench, name: str, overwrite: bool) -> None:
    """Saves the robot, and says so."""
    bench.save(name, overwrite)
    notify(f"saved as {name}", "positive")


def save_dialog(bench: Workbench) -> None:
    """Asks for a name in the folder."""
    with _dialog(f"Save in {bench.folder.root}") as dialog:
        name = ui.input("Name", value=bench.file or f"{bench.robot.value.name}.yaml")
        name.props("dense outlined autofocus").classes("w-full").mark("save-name")
        replace = ui.checkbox("Replace a file of this name").mark("save-replace")
        said = _problem_label()

        def save() -> None:
            if _attempt(said, lambda: save_to(bench, str(name.value or ""), replace.value)):
                dialog.close()

        name.on("keydown.enter", save)
        with ui.row():
            ui.button("Save", on_click=save).props("no-caps").mark("save-now")
            ui.button("Cancel", on_click=dialog.close).props("flat no-caps")


def export_dialog(bench: Workbench) -> None:
    """Hands out the robot in a format, one file or a zip archive of several."""
    with _dialog("Export") as dialog:
        formats = export_formats()
        format = ui.select(
            {name: f"{name}: {words}" for name, words in formats.items()},
            value=next(iter(formats)), label="Format",
        ).props("dense outlined").classes("w-full").mark("export-format")  # fmt: skip
        said = _problem_label()

        def download() -> None:
            def action() -> None:
                files, lost = exported(bench.robot.value, bench.robot.text, str(format.value))
                name, content = _one_file(files)
                ui.download.content(content, name)
                if lost:
                    notify("\n".join(lost), "warning", stays=True)

            if _attempt(said, action):
                dialog.close()

        with ui.row():
            ui.button("Download", on_click=download).props("no-caps").mark("export-now")
            ui.button("Cancel", on_click=dialog.close).props("flat no-caps")


def _one_file(files: dict[str, str]) -> tuple[str, bytes]:
    """Name and content of a file, or of an archive of several."""
    if len(files) == 1:
        name, text = next(iter(files.items()))
        return name, text.encode()
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in files.items():
            archive.writestr(zipfile.ZipInfo(name), text)
    return f"{next(iter(files)).rpartition('_')[0] or 'robot'}.zip", packed.getvalue()


def text_dialog(bench: Workbench) -> None:
    """The robot file itself, to be edited as a whole."""
    with _dialog("The robot file") as dialog:
        text = ui.codemirror(bench.robot.text, language="YAML", line_wrapping=True)
        text.classes("w-full").style("height: 60vh").mark("robot-text")
        said = _problem_label()

        def apply() -> None:
            def action() -> None:
                try:
                    bench.robot.change(str(text.value or ""))
                except CdprError as problem:
                    raise CdprError("\n".join(bench.robot.words(problem, lines=True))) from problem

            if _attempt(said, action):
                dialog.close()

        with ui.row():
            ui.button("Apply", on_click=apply).props("no-caps").mark("apply-text")
            ui.button("Cancel", on_click=dialog.close).props("flat no-caps")
