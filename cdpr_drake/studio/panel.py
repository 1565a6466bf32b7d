"""The table of panels, how one connects to a workbench, and messages in the page.

Errors are messages, too: whatever a handler raises, the server stays alive, see `show_errors`.
"""

from __future__ import annotations

import logging
from collections.abc import Awaitable, Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from inspect import iscoroutinefunction

from nicegui import background_tasks, ui

from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_loader import robot_names
from cdpr_drake.studio.calculator import Signal
from cdpr_drake.studio.session import POSE_NUMBERS, Workbench

WORKSPACES, RUN, COMPARED, LOG, STUDY = "workspaces", "run", "compared", "log", "study"
"""Names of results: computed workspaces, the run that is shown, the one behind it, a log beside the
model, a study."""

LONGEST = 490
"""Characters of a message; longer ones lose their middle."""

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class Panel:
    """A panel of the page.

    Attributes:
        title: On its tab.
        icon: Name of a Material icon.
        place: Its function that places the elements into the current slot, for a workbench, as
            `module:function`; the module is imported behind the page.
        results: The results that it shows by name, with words for a person. It tells
            `Workbench.results` what each is about, and the page says above the panel which are
            about something else than what is open.
    """

    title: str
    icon: str
    place: str
    results: Mapping[str, str]

    def load(self) -> Callable[[Workbench], None]:
        """Imports what the panel needs; returns its function."""
        module, _, function = self.place.partition(":")
        return getattr(import_module(f"cdpr_drake.studio.{module}"), function)


PANELS = {
    "robot": Panel("Robot", "precision_manufacturing", "robot:robot_panel", {}),
    "pose": Panel("Pose", "open_with", "pose:pose_panel", {POSE_NUMBERS: "Numbers"}),
    "workspace": Panel(
        "Workspace", "view_in_ar", "workspace:workspace_panel", {WORKSPACES: "Workspaces"}
    ),
    "run": Panel(
        "Run", "play_circle", "run:run_panel",
        {RUN: "The run that is shown", COMPARED: "The run behind it"},
    ),
    "logs": Panel("Logs", "timeline", "logs:logs_panel", {LOG: "The comparison"}),
    "studies": Panel("Studies", "science", "studies:studies_panel", {STUDY: "Studies"}),
}  # fmt: skip
"""Panels by name, in the order of their tabs."""


def place_remarks(bench: Workbench, panel: Panel) -> None:
    """Places what is to be said about the results of a panel that are about something else."""
    labels, prints = {}, {}
    for name in panel.results:
        labels[name] = ui.label().classes("studio-stale").props('role="status"')
        labels[name].mark(f"about-{name}")
        if (
            name == POSE_NUMBERS
        ):  # always of the robot that is open, and new at each step of a slider
            labels[name].classes("studio-kept")
        else:
            prints[name] = ui.label().classes("studio-fingerprint").mark(f"fingerprint-{name}")

    def refresh() -> None:
        for name, label in labels.items():
            words = bench.results.differs(name)
            label.text = f"{panel.results[name]}: {words}." if words else ""
        for name, label in prints.items():
            subject = bench.results.subject(name)
            label.text = ""
            if subject is not None and subject.digest:
                label.text = f"{panel.results[name]}: {subject.robot}, {subject.fingerprint}"
            if subject is not None:  # robots of its own are nothing to be warned of
                soft = "" if subject.robot else "studio-soft"
                labels[name].classes(add=soft, remove="" if soft else "studio-soft")

    refresh()
    on_page(bench.results.changed, refresh)


def on_page(signal: Signal, listener: Callable[[], Awaitable[None] | None]) -> None:
    """Calls a listener of the page that is being built, until that is closed for good.

    One that waits for something is called soon.
    """
    client = ui.context.client

    async def later() -> None:
        with client:
            await listener()  # type: ignore[misc]

    def soon() -> None:
        background_tasks.create(later(), name="listener")

    client.on_delete(signal.connect(soon if iscoroutinefunction(listener) else listener))  # type: ignore[arg-type]


def robot_argument(bench: Workbench) -> str:
    """By which a command finds the robot as it is: a name, or the path of its file.

    Raises:
        CdprError: It is in no file.
    """
    name = bench.command_name
    if not name:
        raise CdprError("the robot is not saved as it is; save it in the panel Robot first")
    return name if name in robot_names() else str(bench.folder.path(name))


def message(problem: BaseException) -> str:
    """What a problem says, for people, at most `LONGEST` characters a line."""
    if isinstance(problem, CdprError):
        words = str(problem)
    elif isinstance(problem, OSError):
        where = f"{problem.filename}: " if problem.filename else ""
        words = f"{where}{problem.strerror or problem}"
    else:
        words = f"{type(problem).__name__}: {' '.join(str(problem).split()) or 'nothing is known'}"
    lines = ["".join(c if c.isprintable() else repr(c)[1:-1] for c in x) for x in words.split("\n")]
    return "\n".join(
        line if len(line) <= LONGEST else f"{line[: LONGEST * 3 // 4]} ... {line[-LONGEST // 5 :]}"
        for line in lines
    )


def notify(words: str, kind: str = "negative", *, stays: bool = False) -> None:
    """Shows words over the page; `kind` is positive, negative, warning or info.

    What is wrong, and what `stays`, is there until it is closed, all else for four seconds.
    """
    ui.notify(
        words,
        type=kind,  # type: ignore[arg-type]
        multi_line=True,
        close_button="Close",
        timeout=0 if stays or kind == "negative" else 4000,
        classes="studio-notice",
    )


@contextmanager
def show_errors() -> Iterator[None]:
    """Shows what the block raises as a message in the page, and goes on.

    Mistakes of this program are shown, too, and logged with their traceback.
    """
    try:
        yield
    except Exception as problem:
        if not isinstance(problem, (CdprError, OSError)):
            _LOG.exception("in a handler of the studio's page")
        notify(message(problem))
