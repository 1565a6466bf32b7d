"""The pose panel: sliders, and all that is known about the robot where they put it."""

from __future__ import annotations

import shlex
from html import escape
from math import floor, inf, log10
from typing import Any

import numpy as np
from nicegui import ui

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import angles_from_rotation
from cdpr_drake.palette import SLACK, nth_look
from cdpr_drake.studio.dragging import busy_sign
from cdpr_drake.studio.numbers import fact_rows, number_words
from cdpr_drake.studio.panel import message, on_page, show_errors
from cdpr_drake.studio.pose_answer import PoseAnswer, PoseAxis
from cdpr_drake.studio.session import Workbench
from cdpr_drake.tensions.methods import METHODS

THROTTLE = 0.03
"""Least time between two messages of a slider that is dragged [s]."""

COMPILING = "Computing. The first numbers need kernels, which take about a minute to compile once."

OVER = 1.08
"""How far a scale goes beyond the upper limit, so that one sees whether it is passed."""


def pose_panel(bench: Workbench) -> None:
    """Places sliders, choices and numbers."""
    _Sliders(bench)
    with ui.row().classes("studio-row items-end"):
        method = ui.select(_methods(bench), value=bench.method, label="Distribute tensions by")
        method.classes("grow").props("dense options-dense outlined").mark("method")
        reference = ui.number("Desired tension [N]", value=bench.reference, min=0.0)
        reference.props("dense outlined clearable").classes("w-36").mark("reference")
        home = ui.button("Home pose", icon="home").props("outline dense no-caps").mark("home")
        busy_sign(bench)
    waiting = ui.label(COMPILING).classes("studio-soft")
    numbers = ui.html("", sanitize=False).classes("w-full").mark("pose-numbers")
    problem = ui.label().classes("studio-problem").props('role="status"').mark("pose-problem")

    def choose() -> None:
        with show_errors():
            bench.method = str(method.value)
            bench.reference = None if reference.value is None else float(reference.value)
            bench.ask()

    def go_home() -> None:
        with show_errors():
            bench.go_home()
            bench.ask()

    method.on_value_change(choose)
    reference.on_value_change(choose)
    home.on_click(go_home)

    def refresh() -> None:
        answer = bench.answer
        waiting.set_visibility(answer is None and bench.problem is None)
        problem.text = message(bench.problem) if bench.problem is not None else ""
        problem.set_visibility(bench.problem is not None)
        if method.options != (options := _methods(bench)):
            method.set_options(options, value=bench.method)
        elif method.value != bench.method:
            method.value = bench.method
        reference.set_visibility(METHODS[bench.method].needs_reference)
        if answer is not None:
            numbers.content = answer_html(answer, bench.command_name)

    refresh()
    on_page(bench.answered, refresh)
    on_page(bench.robot.changed, refresh)


def _methods(bench: Workbench) -> dict[str, str]:
    """Titles of the methods that the robot takes, and of the chosen one in any case."""
    names = dict.fromkeys([*bench.questions.methods, bench.method])
    return {name: f"{name}: {METHODS[name].title}" for name in names}


class _Sliders:
    """A slider and a field for each coordinate of the pose."""

    def __init__(self, bench: Workbench) -> None:
        self._bench = bench
        self._axes: list[PoseAxis] = []
        self._parts: list[tuple[Any, Any]] = []
        self._box = ui.element("div").classes("studio-sliders")
        self._follow()
        on_page(bench.answered, self._follow)
        on_page(bench.robot.changed, self._follow)

    def _follow(self) -> None:
        """Follows the workbench, which another tab may have moved."""
        if self._bench.questions.axes != self._axes:
            self._axes, self._parts = self._bench.questions.axes, []
            self._box.clear()
            with self._box:
                self._parts = [self._row(k, axis) for k, axis in enumerate(self._axes)]
        for (slider, field), value in zip(self._parts, self._bench.coordinates, strict=True):
            if slider.value != value:
                slider.value = value
                field.value, field.error = _shown(value), None

    def _row(self, k: int, axis: PoseAxis) -> tuple[Any, Any]:
        value = self._bench.coordinates[k]
        step = 0.1 if axis.unit == "deg" else max((axis.upper - axis.lower) / 1000.0, 1e-6)
        ui.label(axis.name).classes("studio-axis").props["title"] = axis.words
        slider = ui.slider(min=axis.lower, max=axis.upper, step=step, value=value)
        slider.props(f'aria-label="{axis.words} [{axis.unit}]" snap=false').mark(f"slider-{k}")
        field = ui.input(value=_shown(value)).props(
            f'dense outlined suffix="{axis.unit}" aria-label="{axis.words}" hide-bottom-space'
        )
        field.classes("studio-number").mark(f"coordinate-{k}")
        slider.on("update:model-value", lambda event: self._move(k, event.args), throttle=THROTTLE)
        for event in ("keydown.enter", "blur"):
            field.on(event, lambda: self._typed(k))
        return slider, field

    def _typed(self, k: int) -> None:
        field, axis = self._parts[k][1], self._axes[k]
        if field.value == _shown(self._bench.coordinates[k]):
            field.error = None
            return
        try:
            value = float(field.value)
        except (TypeError, ValueError):
            value = np.nan
        if axis.lower <= value <= axis.upper:
            self._move(k, value)
        else:
            field.error = (
                f"found {str(field.value)[:40]!r}; accepted: a number from {axis.lower:g} to "
                f"{axis.upper:g} [{axis.unit}]"
            )

    def _move(self, k: int, value: Any) -> None:
        with show_errors():
            if value is None or not np.isfinite(value):
                return
            coordinates = list(self._bench.coordinates)
            coordinates[k] = value = float(value)
            self._bench.move_to(coordinates)
            slider, field = self._parts[k]
            slider.value = value
            field.value, field.error = _shown(value), None


def _shown(value: float) -> str:
    return f"{round(value, 6) + 0.0:g}"


def answer_html(answer: PoseAnswer, name: str) -> str:
    """All numbers at a pose as HTML.

    Args:
        answer: What is known there.
        name: By which the robot is asked for on the command line; empty: it is in no file.
    """
    rest, tensions = answer.rest, answer.why_no_tensions or f"{answer.status}, by {answer.method}"
    lines = [] if rest is None else rest.lines()
    near = f", {answer.nearest}" if answer.nearest else ""
    angles = np.degrees(angles_from_rotation(answer.X_WP.rotation()))
    pose = ",".join(_shown(float(value)) for value in (*answer.X_WP.translation(), *angles))
    words = f"cdpr tension {shlex.quote(name) if name else 'FILE'} --pose={pose}"
    facts = [
        ("cables", answer.robot.geometry_words()),
        ("tensions", tensions),
        ("at rest", answer.why_no_rest if rest is None else f"{rest.stability}, elastic cables"),
        *((label, value) for label, _, value in (line.partition(": ") for line in lines)),
        ("capacity margin [N]", answer.why_no_margin or number_words(answer.capacity_margin)),
        ("clearance [m]", number_words(answer.clearance) + near),
        ("the same command", f"{words} --method={answer.method}"
         + ("" if name else ", once the robot is saved")),
    ]  # fmt: skip
    return _cable_table(answer) + fact_rows(facts)


def _cable_table(answer: PoseAnswer) -> str:
    """A row for each cable: colour, name, tension as a bar between its limits, and lengths."""
    robot, rest, tensions = answer.robot, answer.rest, answer.tensions
    low, high = robot.tension_limits()
    scale = bar_scale(tensions, high if np.isfinite(high) else inf)
    ticks = "".join(
        f'<i class="tick" style="left:{100.0 * bound / scale:.2f}%"></i>'
        for bound in (low, high)
        if 0.0 < bound <= scale
    )
    count = len(robot.cables)
    pulls = _each(tensions, count, 2)
    columns = {
        "length [m]": _each(answer.lengths, count, 4),
        "at rest [N]": _each(None if rest is None else rest.tensions, count, 2),
        "unstrained [m]": _each(None if rest is None else rest.l0, count, 4),
    }
    rows = []
    for k, cable in enumerate(robot.cables):
        color, value = nth_look(k).color, float(tensions[k])
        is_slack = bool(answer.slack[k])
        # Comparisons with NaN are false.
        outside = value < low - 1e-6 * scale or value > high + 1e-6 * scale
        mark = "slack" if is_slack else "out of limits" if outside else ""
        width = 100.0 * min(max(value, 0.0) / scale, 1.0) if np.isfinite(value) else 0.0
        rows.append(
            f"<tr{' class=slack' if mark else ''}>"
            f'<th scope="row"><i class="swatch" style="background:{color}"></i>'
            f"{escape(cable.name)}</th>"
            f'<td class="bar"><div><b style="width:{width:.2f}%;'
            f'background:{SLACK if is_slack else color}"></b>{ticks}</div></td>'
            f'<td>{pulls[k]}</td><td class="mark">{mark}</td>'
            + "".join(f"<td>{column[k]}</td>" for column in columns.values())
            + "</tr>"
        )
    heads = "".join(f"<th>{head}</th>" for head in ("cable", "tension", "[N]", "state", *columns))
    beyond = "" if high <= scale else f"; {high:g} N is beyond the scale"
    return (
        f'<table class="studio-cables"><caption>tensions, limits {low:g} to {high:g} N{beyond}'
        f"</caption><thead><tr>{heads}</tr></thead><tbody>{''.join(rows)}</tbody></table>"
    )


def _each(values: Array | None, count: int, digits: int) -> list[str]:
    """Words for each cable, a dash where there is no value."""
    numbers = np.full(count, np.nan) if values is None else values
    return [f"{value:.{digits}f}" if np.isfinite(value) else "–" for value in numbers]


def bar_scale(values: Array, upper: float) -> float:
    """Where bars end: a round number above all values, which changes seldom as they do.

    It is not above the upper limit, unless a value is.
    """
    largest = float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0))
    if largest >= upper:
        return largest * OVER
    if largest <= 0.0:
        return upper * OVER
    power = 10.0 ** floor(log10(largest))
    steps = (step * power for step in (1.0, 2.0, 5.0, 10.0) if largest * 1.1 <= step * power)
    return min(next(steps, inf), upper * OVER)
