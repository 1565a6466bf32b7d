"""Pause, go, step, speed and stop of a run."""

from __future__ import annotations

from collections.abc import Callable

from nicegui import ui

from cdpr_drake.studio.boards import RunBoard
from cdpr_drake.studio.jobs import JobState
from cdpr_drake.studio.panel import show_errors
from cdpr_drake.studio.run_job import RunJob

AS_FAST = "as fast as possible"
SPEEDS: dict[str, float | None] = {
    "x 0.1": 0.1, "x 0.5": 0.5, "real time": 1.0, "x 2": 2.0, "x 5": 5.0, "x 20": 20.0,
    AS_FAST: None,
}  # fmt: skip
"""Speeds that are offered."""


class SteeringBar:
    """Buttons for the run that is looked at, as far as it takes them."""

    def __init__(self, board: RunBoard, current: Callable[[], RunJob | None]) -> None:
        """Places them into the current slot.

        Args:
            board: What the session looks at.
            current: The job that is looked at; None: there is none.
        """
        self._current = current
        now = next((words for words, speed in SPEEDS.items() if speed == board.speed), AS_FAST)

        def set_speed() -> None:
            board.speed = SPEEDS[str(self._speed.value)]
            job = current()
            if job is not None:
                with show_errors():
                    job.set_speed(board.speed)

        self._speed = ui.select(list(SPEEDS), value=now, label="speed", on_change=set_speed)
        self._speed.props("dense outlined").classes("cdpr-speed").mark("speed")
        self._pause = self._button("pause", "Pause", lambda job: job.pause())
        self._go = self._button("play_arrow", "Go on", lambda job: job.go())
        self._step = self._button("skip_next", "Step", lambda job: job.step())
        self._stop = self._button("stop", "Stop", lambda job: job.stop())
        self.refresh()

    def _button(self, icon: str, words: str, act: Callable[[RunJob], None]) -> ui.button:
        def pressed() -> None:
            job = self._current()
            if job is not None:
                with show_errors():
                    act(job)

        button = ui.button(icon=icon, on_click=pressed)
        button.props(f'dense aria-label="{words}" title="{words}"')
        return button.mark(words.lower().replace(" ", "-"))

    def refresh(self) -> None:
        """Offers what the run takes now."""
        job = self._current()
        state = None if job is None else job.state
        standing = job is not None and bool(job.pace.get("paused"))
        working = state in (JobState.QUEUED, JobState.RUNNING, JobState.PAUSED)
        self._pause.set_enabled(working and not standing)
        self._go.set_enabled(working and standing)
        self._step.set_enabled(state == JobState.PAUSED)
        self._stop.set_enabled(working)
