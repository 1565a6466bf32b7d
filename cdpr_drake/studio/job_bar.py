"""Progress, stop and go on of a command."""

from __future__ import annotations

from nicegui import ui

from cdpr_drake.studio.boards import CommandBoard, CommandEntry
from cdpr_drake.studio.jobs import JobState
from cdpr_drake.studio.panel import show_errors


class JobBar:
    """Which results are looked at, how far the command is, and what it may be asked for."""

    def __init__(self, board: CommandBoard, label: str) -> None:
        """Places it into the current slot, with a label of the list of results."""
        self._board = board
        name = board.name
        with ui.row().classes("w-full items-center no-wrap"):
            self._choice = ui.select({}, label=label, on_change=self._choose)
            self._choice.props("dense outlined").classes("col").mark(f"{name}-results")
            self._stop = ui.button(icon="stop", on_click=self._ask_to_stop).mark(f"{name}-stop")
            self._stop.props('dense aria-label="Stop" title="Stop; what is finished is kept"')
            self._go_on = ui.button("Continue", on_click=self._ask_to_go_on)
            self._go_on.props('dense no-caps outline title="Goes on where it was stopped"')
            self._go_on.mark(f"{name}-continue")
        self._bar = ui.linear_progress(0.0, show_value=False).props("size=8px")
        self._state = ui.label().classes("studio-soft").props('role="status"')
        self._state.mark(f"{name}-state")
        self.refresh()

    @property
    def computed(self) -> CommandEntry | None:
        """What is looked at."""
        return self._board.choices().get(self._board.shown)

    def refresh(self) -> None:
        """Follows jobs and folders."""
        board, choices = self._board, self._board.choices()
        if board.shown not in choices:
            board.shown = next(iter(choices), "")
        names = {key: computed.name for key, computed in choices.items()}
        if names != self._choice.options:
            self._choice.set_options(names, value=board.shown or None)
        self._choice.value = board.shown or None
        computed = choices.get(board.shown)
        job = None if computed is None else computed.job
        asked = () if computed is None else computed.asked
        working = job is not None and not job.state.is_over
        self._stop.set_enabled(working and job is not None and job.state != JobState.STOPPING)
        self._go_on.set_visibility(bool(asked))
        self._bar.set_visibility(working)
        if job is None:
            self._state.text = "stopped with an earlier server" if asked else ""
            return
        fraction, said = job.progress
        self._bar.props(remove="indeterminate", add="indeterminate" if fraction is None else "")
        self._bar.value = fraction or 0.0
        last = job.lines[-1] if working and job.lines else ""
        parts = [job.state.value, f"{job.elapsed:.0f} s", job.message or said or last]
        self._state.text = ", ".join(part for part in parts if part)

    def _choose(self) -> None:
        if self._choice.value and self._choice.value != self._board.shown:
            self._board.shown = str(self._choice.value)
            self.refresh()

    def _ask_to_stop(self) -> None:
        if self.computed is not None and self.computed.job is not None:
            self.computed.job.stop()
        self.refresh()

    def _ask_to_go_on(self) -> None:
        with show_errors():
            if self.computed is not None:
                self._board.go_on(self.computed)
            self.refresh()
