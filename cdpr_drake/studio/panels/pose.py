"""The pose panel: sliders, and all that is known about the robot where they put it."""

from __future__ import annotations

import shlex
from typing import Any

import numpy as np
from nicegui import ui

from cdpr_drake.geometry.poses import angles_from_rotation
from cdpr_drake.studio.panel import message, on_page, show_errors
from cdpr_drake.studio.panels.numbers import cable_table, fact_table, number_words
from cdpr_drake.studio.workbench.pose_answer import PoseAnswer
from cdpr_drake.studio.workbench.pose_axes import PoseAxis
from cdpr_drake.studio.workbench.session import Workbench
from cdpr_drake.tensions.methods import METHODS

THROTTLE = 0.03
"""Least time between two messages of a slider that is dragged [s]."""

COMPILING = (
    "Kernels are being loaded, at the first use compiled, which takes about a minute; numbers come "
    "then."
)


def pose_panel(bench: Workbench) -> None:
    """Places sliders, choices and numbers."""
    _Sliders(bench)
    with ui.row().classes("studio-row items-end"):
        method = ui.select(_methods(bench), value=bench.method, label="Tensions by")
        method.classes("grow").props("dense options-dense outlined").mark("method")
        reference = ui.number("Wanted tension [N]", value=bench.reference, min=0.0)
        reference.props("dense outlined clearable").classes("w-36").mark("reference")
        home = ui.button("Home pose", icon="home").props("outline dense no-caps").mark("home")
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
        failed = bench.problem is not None
        waiting.set_visibility(answer is None and not failed)
        problem.text = message(bench.problem) if bench.problem is not None else ""
        problem.set_visibility(failed)
        if answer is None:
            return
        if method.options != (options := {**_titles(answer.methods), **_methods(bench)}):
            method.set_options(options, value=bench.method)
        elif method.value != bench.method:
            method.value = bench.method
        reference.set_visibility(METHODS[bench.method].needs_reference)
        numbers.content = answer_html(answer, bench.command_name)

    refresh()
    on_page(bench.answered, refresh)
    on_page(bench.robot.changed, refresh)


def _methods(bench: Workbench) -> dict[str, str]:
    """The methods that the robot takes; the chosen one in any case."""
    names = [bench.method] if bench.answer is None else [*bench.answer.methods, bench.method]
    return _titles(list(dict.fromkeys(names)))


def _titles(names: list[str]) -> dict[str, str]:
    return {name: f"{name}: {METHODS[name].title}" for name in names}


class _Sliders:
    """A slider and a field for each coordinate of the pose."""

    def __init__(self, bench: Workbench) -> None:
        self._bench = bench
        self._axes: list[PoseAxis] = []
        self._parts: list[tuple[Any, Any]] = []
        self._box = ui.element("div").classes("studio-sliders")
        self._fill()
        on_page(bench.answered, self._refresh)
        on_page(bench.robot.changed, self._refresh)

    def _fill(self) -> None:
        self._axes, self._parts = self._bench.questions.axes, []
        self._box.clear()
        with self._box:
            for k, axis in enumerate(self._axes):
                self._row(k, axis)

    def _row(self, k: int, axis: PoseAxis) -> None:
        value = self._bench.coordinates[k]
        step = 0.1 if axis.unit == "deg" else max((axis.upper - axis.lower) / 1000.0, 1e-6)
        ui.label(axis.name).classes("studio-axis").props["title"] = axis.words
        slider = ui.slider(min=axis.lower, max=axis.upper, step=step, value=value)
        slider.props(f'aria-label="{axis.words} [{axis.unit}]" snap=false').mark(f"slider-{k}")
        field = ui.input(value=_shown(value)).props(
            f'dense outlined suffix="{axis.unit}" aria-label="{axis.words}" hide-bottom-space'
        )
        field.classes("studio-number").mark(f"coordinate-{k}")
        slider.on(
            "update:model-value",
            lambda event, k=k: self._slid(k, event.args),
            throttle=THROTTLE,
        )
        field.on("keydown.enter", lambda k=k: self._typed(k))
        field.on("blur", lambda k=k: self._typed(k))
        self._parts.append((slider, field))

    def _slid(self, k: int, value: Any) -> None:
        with show_errors():
            if value is not None and np.isfinite(value):
                self._move(k, float(value))

    def _typed(self, k: int) -> None:
        field, axis = self._parts[k][1], self._axes[k]
        if field.value == _shown(self._bench.coordinates[k]):
            field.error = None
            return
        try:
            value = float(field.value)
        except (TypeError, ValueError):
            value = np.nan
        if not axis.lower <= value <= axis.upper:
            field.error = (
                f"found {str(field.value)[:40]!r}; accepted: a number from {axis.lower:g} to "
                f"{axis.upper:g} [{axis.unit}]"
            )
            return
        with show_errors():
            self._move(k, value)

    def _move(self, k: int, value: float) -> None:
        coordinates = list(self._bench.coordinates)
        coordinates[k] = value
        self._bench.move_to(coordinates)
        slider, field = self._parts[k]
        slider.value = value
        field.value, field.error = _shown(value), None

    def _refresh(self) -> None:
        """Follows the workbench, which another tab may have moved."""
        if self._bench.questions.axes != self._axes:
            self._fill()
            return
        for (slider, field), value in zip(self._parts, self._bench.coordinates, strict=True):
            if slider.value != value:
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
    robot, rest = answer.robot, answer.rest
    columns = {
        "length [m]": _each(answer.lengths, len(robot.cables), "{:.4f}"),
        "at rest [N]": _each(None if rest is None else rest.tensions, len(robot.cables), "{:.2f}"),
        "unstrained [m]": _each(None if rest is None else rest.l0, len(robot.cables), "{:.4f}"),
    }
    names = [cable.name for cable in robot.cables]
    table = cable_table(names, answer.tensions, robot.tension_limits(), answer.slack, columns)
    return table + fact_table(_facts(answer, name))


def _each(values: Any, count: int, form: str) -> list[str]:
    if values is None:
        return ["–"] * count
    return [form.format(value) if np.isfinite(value) else "–" for value in values]


def _facts(answer: PoseAnswer, name: str) -> dict[str, str]:
    rest = answer.rest
    facts = {
        "cables": answer.geometry,
        "tensions": answer.why_no_tensions or f"{answer.status}, by {answer.method}",
    }
    if rest is None:
        facts["at rest"] = answer.why_no_rest
    else:
        facts["at rest"] = f"{rest.stability}, elastic cables"
        facts[f"stiffness [N/m], turns times {rest.arm:.3g} m"] = _list(rest.principal)
        if rest.frequencies is not None:
            facts["natural frequencies [Hz]"] = _list(rest.frequencies)
    facts["capacity margin [N]"] = number_words(answer.capacity_margin)
    near = f", {answer.nearest}" if answer.nearest else ""
    facts["clearance [m]"] = number_words(answer.clearance) + near
    if answer.notes:
        facts["capacity margin [N]"] = answer.notes
    asked = f"--pose={_pose(answer)} --method={answer.method}"
    facts["the same"] = (
        f"cdpr tension {shlex.quote(name)} {asked}"
        if name
        else f"cdpr tension FILE {asked}, once the robot is saved"
    )
    return facts


def _list(values: Any) -> str:
    return ", ".join(number_words(float(value)) for value in values)


def _pose(answer: PoseAnswer) -> str:
    angles = np.degrees(angles_from_rotation(answer.X_WP.rotation()))
    return ",".join(_shown(float(value)) for value in (*answer.X_WP.translation(), *angles))
