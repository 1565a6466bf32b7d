"""The table of panels, how one connects to a workbench, and messages in the page.

Errors are messages, too: whatever a handler raises, the server stays alive, see `show_errors`.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import import_module

from nicegui import ui

from cdpr_drake.errors import CdprError
from cdpr_drake.studio.session import POSE_NUMBERS, Workbench

WORKSPACES, RUN, COMPARED, LOG, STUDY, ANSWER = (
    "workspaces", "run", "compared", "log", "study", "answer",
)  # fmt: skip
"""Names of results: computed workspaces, the run that is shown, the one behind it, a log beside the
model, a study, what a command answered."""

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
        results: Titles of the results that it shows, by name. The panel tells `Workbench.results`
            what each is about; the page says above the panel which are about something else than
            what is open.
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
    results = bench.results
    rows = {name: (ui.label().mark(f"about-{name}"), ui.label().mark(f"fingerprint-{name}"))
            for name in panel.results}  # fmt: skip
    for name, (differs, print_) in rows.items():
        # Numbers at the pose change with each step of a slider: their row is always there.
        differs.classes(f"studio-stale {'studio-kept' if name == POSE_NUMBERS else ''}")
        differs.props('role="status"')
        print_.classes("studio-fingerprint")

    def refresh() -> None:
        for name, (differs, print_) in rows.items():
            title, words, subject = (
                panel.results[name],
                results.differs(name),
                results.subject(name),
            )
            differs.text = f"{title}: {words}." if words else ""
            print_.text = ""
            if subject is not None:  # robots of its own are nothing to be warned of
                soft = "" if subject.robot else "studio-soft"
                differs.classes(add=soft, remove="" if soft else "studio-soft")
                if subject.digest and name != POSE_NUMBERS:
                    print_.text = f"{title}: {subject.robot}, {subject.fingerprint}"

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
    """Shows what the block raises as a message in the page, and goes on.

    Mistakes of this program are shown, too, and logged with their traceback.
    """
    try:
        yield
    except Exception as problem:
        if not isinstance(problem, (CdprError, OSError)):
            _LOG.exception("in a handler of the studio's page")
        notify(message(problem))
