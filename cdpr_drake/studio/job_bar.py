"""Progress, stop and go on of a command."""

from __future__ import annotations

from nicegui import ui

from cdpr_drake.studio.boards import CommandBoard, CommandEntry
from cdpr_drake.studio.jobs import JobState
from cdpr_drake.studio.panel import show_errors


class JobBar:
    """Which results are looked at, how far the command is, and what it may be asked for."""

    def __init__(self, board: CommandBoard, label: str) -> None:
        """Places it into the current slot.

        Args:
            board: What the session looks at.
            label: Of the list of results.
        """
        self._board = board
        self._names: dict[str, str] = {}
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
        choices = self._board.choices()
        if self._board.shown not in choices:
            self._board.shown = next(iter(choices), "")
        names = {key: computed.name for key, computed in choices.items()}
        if names != self._names:
            self._names = names
            self._choice.set_options(names, value=self._board.shown or None)
        elif self._choice.value != (self._board.shown or None):
            self._choice.value = self._board.shown or None
        self._show(choices.get(self._board.shown))

    def _show(self, computed: CommandEntry | None) -> None:
        job = None if computed is None else computed.job
        working = job is not None and not job.state.is_over
        asked = () if computed is None or working else computed.asked
        self._stop.set_enabled(working and job is not None and job.state != JobState.STOPPING)
        self._go_on.set_visibility(bool(asked))
        self._bar.set_visibility(working)
        words = "stopped with an earlier server" if asked and job is None else ""
        if job is not None:
            fraction, said = job.progress
            self._bar.props(remove="indeterminate", add="indeterminate" if fraction is None else "")
            self._bar.value = fraction or 0.0
            last = job.lines[-1] if working and not said and job.lines else ""
            parts = [job.state.value, f"{job.elapsed:.0f} s", job.message or said or last]
            words = ", ".join(part for part in parts if part)
        if self._state.text != words:
            self._state.text = words

    def _choose(self) -> None:
        if self._choice.value and self._choice.value != self._board.shown:
            self._board.shown = str(self._choice.value)
            self.refresh()

    def _ask_to_stop(self) -> None:
        computed = self.computed
        if computed is not None and computed.job is not None:
            computed.job.stop()
            self.refresh()

    def _ask_to_go_on(self) -> None:
        computed = self.computed
        with show_errors():
            if computed is not None:
                self._board.go_on(computed)
                self.refresh()
