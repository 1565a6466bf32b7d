"""The panel of all commands: any verb with its form, and what it leaves."""

from __future__ import annotations

from cdpr_drake.studio.panel import ANSWER
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.verb_panel import VerbPanel, VerbTab

TAB = VerbTab(
    folder="commands", result=ANSWER, first={"tension": ("pose", "method", "pulleys", "wrench")},
    empty="No result yet. Choose a question and press Start; a command about a robot takes the "
    "open one.",
)  # fmt: skip


def commands_panel(bench: Workbench) -> None:
    """Places the panel."""
    VerbPanel(bench, TAB, show=lambda view: view.place(unfolded=True))
