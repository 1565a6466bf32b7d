"""What a panel is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from nicegui import ui

from cdpr_drake.errors import CdprError
from cdpr_drake.models import robot_names
from cdpr_drake.studio.workbench import POSE_NUMBERS, Signal, Workbench


@dataclass(frozen=True)
class Panel:
    """A panel of the page.

    Attributes:
        name: In addresses and tests.
        title: On its tab.
        icon: Name of a Material icon.
        results: The results that it shows by name, with words for a person. It tells
            `Workbench.results` what each is about, and the page says above the panel which are
            about something else than what is open.
        build: Places its elements into the current slot, for a workbench.
    """

    name: str
    title: str
    icon: str
    results: Mapping[str, str]
    build: Callable[[Workbench], None]


def place_remarks(bench: Workbench, panel: Panel) -> None:
    """Places what is to be said about the results of a panel that are about something else."""
    labels = {
        name: ui.label().classes("studio-stale").props('role="status"').mark(f"about-{name}")
        for name in panel.results
    }
    if POSE_NUMBERS in labels:  # they change at each step of a slider: nothing may jump
        labels[POSE_NUMBERS].classes("studio-kept")

    def refresh() -> None:
        for name, label in labels.items():
            words = bench.results.differs(name)
            said = f"{panel.results[name]}: {words}." if words else ""
            if label.text != said:
                label.text = said

    refresh()
    on_page(bench.results.changed, refresh)


def on_page(signal: Signal, listener: Callable[[], None]) -> None:
    """Calls a listener of the page that is being built, until that is closed for good."""
    ui.context.client.on_delete(signal.connect(listener))


def robot_argument(bench: Workbench) -> str:
    """By which a command finds the robot as it is: a name, or the path of its file.

    Raises:
        CdprError: It is in no file.
    """
    name = bench.command_name
    if not name:
        raise CdprError("the robot is not saved as it is; save it in the panel Robot first")
    return name if name in robot_names() else str(bench.folder.path(name))
