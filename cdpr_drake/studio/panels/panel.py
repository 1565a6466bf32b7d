"""What a panel is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from nicegui import ui

from cdpr_drake.studio.workbench import Signal, Workbench


@dataclass(frozen=True)
class Panel:
    """A panel of the page.

    Attributes:
        name: In addresses and tests.
        title: On its tab.
        icon: Name of a Material icon.
        build: Places its elements into the current slot, for a workbench.
    """

    name: str
    title: str
    icon: str
    build: Callable[[Workbench], None]


def on_page(signal: Signal, listener: Callable[[], None]) -> None:
    """Calls a listener of the page that is being built, until that is closed for good."""
    ui.context.client.on_delete(signal.connect(listener))
