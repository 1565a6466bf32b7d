"""Another robot beside the one that is open: fields that differ, and numbers at home."""

from __future__ import annotations

from concurrent.futures import Future

from nicegui import ui

from cdpr_drake.models.robot_loader import robot_names
from cdpr_drake.studio.numbers import pair_table
from cdpr_drake.studio.panel import on_page, show_errors
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.workbench.side_by_side import Pair, robots_side_by_side

NOTHING = "none"

FILES = (".yaml", ".yml")


class RobotBeside:
    """Chooses another robot, and shows both in numbers as long as the folded part is open."""

    def __init__(self, bench: Workbench) -> None:
        """Places it into the current slot."""
        self._bench, self._number = bench, 0
        with ui.expansion("Beside another robot").classes("w-full studio-group") as self._fold:
            self._fold.mark("robot-beside")
            self._other = ui.select([NOTHING], value=NOTHING, label="other robot")
            self._other.props("dense outlined").classes("w-full").mark("other-robot")
            self._table = ui.html("", sanitize=False).classes("w-full").mark("robot-pairs")
        self._fold.on_value_change(self._unfold)
        self._other.on_value_change(self._compare)
        on_page(bench.robot.changed, self._compare)

    def _unfold(self) -> None:
        if self._fold.value:
            names = [NOTHING, *robot_names(), *self._bench.folder.files(FILES)]
            self._other.set_options(names, value=self._other.value)

    def _compare(self) -> None:
        name = str(self._other.value)
        self._number += 1
        if name == NOTHING:
            self._table.content = ""
            return
        with show_errors():
            bench, number = self._bench, self._number
            one = bench.robot.value

            def show(future: Future[list[Pair]]) -> None:
                with self._table, show_errors():
                    pairs = future.result()
                    if number == self._number:
                        now = f"{one.name}, open"
                        self._table.content = pair_table(pairs, now, name)

            bench.calculator.run(lambda: robots_side_by_side(one, bench.files.robot(name)), show)
