"""The robot panel: a robot's file, dialogs about it, its fields, and another robot beside it."""

from __future__ import annotations

import asyncio
import io
import zipfile
from collections.abc import Awaitable, Callable
from functools import partial
from html import escape
from typing import Any

from nicegui import events, ui

from cdpr_drake.formats.robot_exchange import export_robot
from cdpr_drake.formats.robot_exports import EXPORTS, export_omissions, omission_words
from cdpr_drake.models.robot_loader import robot_names
from cdpr_drake.studio.dragging import add_point_dragging, live_workspace_bar
from cdpr_drake.studio.files import LARGEST_UPLOAD, MOST_UPLOADS, UPLOADS, OpenedRobot
from cdpr_drake.studio.numbers import Pair, pair_table, robots_side_by_side
from cdpr_drake.studio.panel import notify, show_errors
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.settings_form import SettingsForm, dialog, document_buttons, tool

FIRST = ("cables", "platform", "tension_bounds")
OPENED = ("cables", "tension_bounds")

NO_FILE = "not in a file of the folder yet; Save as puts it there"
NOTHING = "none"

YAML = "yaml"
"""The package's own format, beside those of `EXPORTS`."""


def robot_panel(bench: Workbench) -> None:
    """Places buttons, title and groups of fields."""
    with ui.row().classes("studio-bar"):
        for words, icon, action in (
            ("Open", "folder_open", open_dialog), ("Save", "save", _save),
            ("Save as", "save_as", save_dialog), ("Export", "file_download", export_dialog),
        ):  # fmt: skip
            tool(words, icon, partial(_act, bench, action)).mark(words.lower().replace(" ", "-"))
        document_buttons(bench.robot, "The robot file")
    title = ui.label().classes("studio-title").mark("robot-title")
    where = ui.label().classes("studio-soft").mark("robot-file")
    card = ui.element("section").classes("studio-card").mark("assumed")
    with card.props('aria-label="What was assumed"'):
        ui.label("What this robot's file did not say").classes("studio-subtitle")
        assumed = ui.html("", sanitize=False)
        tool("Seen", "check", bench.forget_assumed).mark("assumed-seen")

    def refresh() -> None:
        robot = bench.robot.value
        title.text = f"{robot.name}: {robot.title}" if robot.title else robot.name
        where.text = f"{bench.file}: {bench.state}" if bench.file else NO_FILE
        card.set_visibility(bool(bench.assumed))
        items = "".join(f"<li>{escape(line)}</li>" for line in bench.assumed)
        assumed.content = f"<ul>{items}</ul>"

    live_workspace_bar(bench)
    SettingsForm(bench.robot, first=FIRST, opened=OPENED)
    place_beside(bench)
    add_point_dragging(bench)
    refresh()
    bench.robot.changed.subscribe(refresh)


async def _act(bench: Workbench, action: Callable[[Workbench], Awaitable[None]]) -> None:
    """Does something with the robot once what was typed last is in it."""
    await bench.robot.settled()
    await action(bench)


async def open_dialog(bench: Workbench) -> None:
    """Chooses a robot of the package, a file of the folder, or files of this computer."""

    async def take(read: Callable[..., OpenedRobot], what: Any) -> None:
        opened = await asyncio.to_thread(read, what)
        bench.take_opened(opened)
        if opened.notes:
            notify(opened.notes[0], "info")

    async def choose(event: Any) -> None:
        if event.value:
            await attempt(partial(take, bench.files.open, str(event.value)))

    async def receive(event: events.MultiUploadEventArguments) -> None:
        content = {file.name: await file.read() for file in event.files}
        if not await attempt(partial(take, bench.files.upload, content)):
            upload.reset()

    files = await asyncio.to_thread(bench.folder.files, UPLOADS)
    with dialog("Open a robot") as attempt:
        for mark, label, names in (
            ("open-robot", "Robot of the package", list(robot_names())),
            ("open-file", f"File in {bench.folder.root}", files),
        ):
            chosen = ui.select(names, label=label, with_input=True, on_change=choose)
            chosen.classes("w-full").mark(mark)
        too_large = (
            f"found a file that is too large, or too many; accepted: up to {MOST_UPLOADS} files of "
            f"at most {LARGEST_UPLOAD:,} bytes"
        )
        upload = ui.upload(
            label="Drop files here: robot.yaml, or those of another tool",
            multiple=True, auto_upload=True, max_file_size=LARGEST_UPLOAD, max_files=MOST_UPLOADS,
            on_multi_upload=receive, on_rejected=lambda: notify(too_large),
        )  # fmt: skip
        upload.classes("studio-drop").props("flat bordered").mark("upload")
        ui.label("Read: " + ", ".join(UPLOADS)).classes("studio-soft")


async def _save(bench: Workbench) -> None:
    if not bench.file:
        await save_dialog(bench)
        return
    await bench.save(bench.file, overwrite=True)
    notify(f"saved as {bench.file}", "positive")


async def save_dialog(bench: Workbench) -> None:
    """Asks for a name in the folder."""

    async def save() -> None:
        await bench.save(str(name.value or ""), replace.value)
        notify(f"saved as {name.value}", "positive")

    with dialog(f"Save in {bench.folder.root}", "Save", save) as attempt:
        name = ui.input("Name", value=bench.file or f"{bench.robot.value.name}.yaml")
        name.props("autofocus").classes("w-full").mark("save-name")
        name.on("keydown.enter", partial(attempt, save))
        replace = ui.checkbox("Replace a file of this name").mark("save-replace")


async def export_dialog(bench: Workbench) -> None:
    """Hands out the robot in a format, one file or a zip archive of several."""

    async def download() -> None:
        robot, chosen = bench.robot.value, str(select.value)
        files, lost = {f"{robot.name}.yaml": bench.robot.text}, None
        if chosen != YAML:
            files, lost = export_robot(robot, chosen), export_omissions(robot, chosen)
        name, content = next(iter(files.items()))
        if len(files) == 1:
            ui.download.content(content, name)
        else:
            ui.download.content(_zipped(files), f"{name.rpartition('_')[0] or 'robot'}.zip")
        if lost:
            notify("\n".join(omission_words(lost)), "warning", stays=True)

    with dialog("Export", "Download", download):
        formats = {YAML: "cdpr_drake's robot file"} | EXPORTS
        options = {name: f"{name}: {words}" for name, words in formats.items()}
        select = ui.select(options, value=YAML, label="Format")
        select.classes("w-full").mark("export-format")


def _zipped(files: dict[str, str]) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in files.items():
            archive.writestr(zipfile.ZipInfo(name), text)
    return packed.getvalue()


def place_beside(bench: Workbench) -> None:
    """Places a choice of another robot, which is shown beside the one that is open."""
    with ui.expansion("Beside another robot").classes("w-full studio-group") as fold:
        other = ui.select([NOTHING], value=NOTHING, label="other robot").mark("other-robot")
        other.classes("w-full")
        table = ui.html("", sanitize=False).classes("w-full").mark("robot-pairs")

    async def unfold() -> None:
        files = await asyncio.to_thread(bench.folder.files, (".yaml", ".yml"))
        other.set_options([NOTHING, *robot_names(), *files], value=other.value)

    async def compare() -> None:
        name, one = str(other.value), bench.robot.value

        def work() -> list[Pair]:
            opened = bench.files.open(name)
            return robots_side_by_side(one, bench.files.read(opened.text, opened.path))

        content = ""
        with show_errors():
            if name != NOTHING:
                pairs = await asyncio.wrap_future(bench.calculator.submit(work))
                content = pair_table(pairs, f"{one.name}, open", name)
            if name == other.value and one is bench.robot.value:
                table.content = content

    fold.on_value_change(unfold).mark("robot-beside")
    other.on_value_change(compare)
    bench.robot.changed.subscribe(compare)
