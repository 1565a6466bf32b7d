"""The table of panels, how one connects to a workbench, and messages in the page.

Errors are messages, too: whatever a handler raises, the page says it, see `say_errors`. Mistakes of
this program are logged as well, with their traceback.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

from nicegui import app, ui

from cdpr_drake.errors import CdprError
from cdpr_drake.studio.session import POSE_NUMBERS, Workbench

WORKSPACES, RUN, COMPARED, LOG, STUDY, ANSWER = (
    "workspaces", "run", "compared", "log", "study", "answer",
)  # fmt: skip
"""Names of results: computed workspaces, the run that is shown, the one behind it, a log beside the
model, a study, what a command answered."""

LONGEST = 490
"""Characters of a message; longer ones lose their middle."""


@dataclass(frozen=True)
class Panel:
    """A panel of the page.

    Attributes:
        icon: Name of a Material icon.
        place: `module:function` that places the elements for a workbench; imported behind the page.
        results: Titles of the results that it shows, by name. It tells `Workbench.results` what
            each is about; the page says above it which are about something else than what is open.
    """

    title: str
    icon: str
    place: str
    results: dict[str, str] = field(default_factory=dict)

    def load(self) -> Callable[[Workbench], None]:
        """Imports what the panel needs; returns its function."""
        module, _, function = self.place.partition(":")
        return getattr(import_module(f"cdpr_drake.studio.{module}"), function)


PANELS = {
    "robot": Panel("Robot", "precision_manufacturing", "robot:robot_panel"),
    "pose": Panel("Pose", "open_with", "pose:pose_panel", {POSE_NUMBERS: "Numbers"}),
    "workspace": Panel(
        "Workspace", "view_in_ar", "workspace:workspace_panel", {WORKSPACES: "Workspaces"}
    ),
    "run": Panel(
        "Run", "play_circle", "run:run_panel",
        {RUN: "The run that is shown", COMPARED: "The run behind it"},
    ),
    "logs": Panel("Logs", "timeline", "logs:logs_panel", {LOG: "The comparison"}),
    "studies": Panel("Studies", "science", "verb_panel:studies_panel", {STUDY: "Studies"}),
    "commands": Panel("Commands", "terminal", "verb_panel:commands_panel", {ANSWER: "The answer"}),
}  # fmt: skip
"""Panels by name, in the order of their tabs."""


def place_remarks(bench: Workbench, panel: Panel) -> None:
    """Places what is to be said about the results of a panel: of which robot they are."""
    for name, title in panel.results.items():
        _place_remark(bench, name, title)


def _place_remark(bench: Workbench, name: str, title: str) -> None:
    results, is_pose = bench.results, name == POSE_NUMBERS
    differs = ui.label().classes("studio-stale").props('role="status"').mark(f"about-{name}")
    print_ = ui.label().classes("studio-fingerprint").mark(f"fingerprint-{name}")
    if is_pose:  # which change with each step of a slider: their row is always there
        differs.classes("studio-kept")

    def refresh() -> None:
        # Nothing is set twice: a browser builds the page anew for each change of an element.
        words, subject = results.differs(name), results.subject(name)
        differs.text = f"{title}: {words}." if words else ""
        is_own = subject is not None and not subject.robot  # nothing to be warned of
        differs.classes(add="studio-soft" if is_own else "", remove="" if is_own else "studio-soft")
        print_.text = (
            f"{title}: {subject.robot}, {subject.fingerprint}"
            if subject is not None and subject.digest and not is_pose
            else ""
        )

    refresh()
    results.changed.subscribe(refresh)


def robot_argument(bench: Workbench) -> str:
    """By which a command finds the robot as it is: a name, or the path of its file.

    Raises:
        CdprError: It is in no file.
    """
    if not (name := bench.command_name):
        raise CdprError("the robot is not saved as it is; save it in the panel Robot first")
    return str(bench.robot.path) if name == bench.file else name


def offer(select: ui.select, options: Mapping[Any, str], value: Any) -> None:
    """Changes options only where they are others: that closes a list that is unfolded."""
    if select.options != options:
        select.set_options(dict(options), value=value)
    select.value = value


def message(problem: BaseException) -> str:
    """What a problem says, for people, at most `LONGEST` characters a line."""
    words = str(problem)
    if isinstance(problem, OSError):
        words = f"{problem.filename or ''}: {problem.strerror or problem}".removeprefix(": ")
    elif not isinstance(problem, CdprError):
        words = f"{type(problem).__name__}: {' '.join(words.split()) or 'nothing is known'}"
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
        words, type=kind, multi_line=True, close_button="Close", classes="studio-notice",  # type: ignore[arg-type]
        timeout=0 if stays or kind == "negative" else 4000,
    )  # fmt: skip


@contextmanager
def show_errors() -> Iterator[None]:
    """Shows what the block raises as a message in the page, and goes on, as `say_errors`."""
    try:
        yield
    except Exception as problem:
        app.handle_exception(problem)


def say_errors() -> None:
    """Has the page that is being built show what its handlers raise as messages."""
    ui.on_exception(lambda problem: notify(message(problem)))


def _is_mistake(record: logging.LogRecord) -> bool:
    return not isinstance(record.msg, CdprError | OSError)


for field_kind in (ui.input, ui.number, ui.select):
    field_kind.default_props("dense outlined")

logging.getLogger("nicegui").addFilter(_is_mistake)  # refusals are for the page alone
