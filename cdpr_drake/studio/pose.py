"""The pose panel: sliders, and all that is known about the robot where they put it."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from html import escape
from math import ceil, log2
from typing import Any

import numpy as np
from nicegui import ui

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import angles_from_rotation
from cdpr_drake.palette import SLACK, nth_look
from cdpr_drake.studio.dragging import busy_sign
from cdpr_drake.studio.numbers import fact_rows, number_words
from cdpr_drake.studio.panel import message
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
    sliders_follow = _place_sliders(bench)
    with ui.row().classes("studio-row items-end"):
        method = ui.select(_methods(bench), value=bench.method, label="Distribute tensions by")
        method.classes("grow").props("options-dense").mark("method")
        reference = ui.number("Desired tension [N]", value=bench.reference, min=0.0)
        reference.props("clearable").classes("w-36").mark("reference")
        home = ui.button("Home pose", icon="home").props("outline dense no-caps").mark("home")
        busy_sign(bench)
    waiting = ui.label(COMPILING).classes("studio-soft")
    numbers = ui.html("", sanitize=False).classes("w-full").mark("pose-numbers")
    problem = ui.label().classes("studio-problem").props('role="status"').mark("pose-problem")
    problem.bind_visibility_from(problem, "text", bool)

    def choose() -> None:
        bench.method, bench.reference = str(method.value), reference.value
        bench.ask()

    def go_home() -> None:
        bench.go_home()
        bench.ask()

    def refresh() -> None:
        sliders_follow()
        answer = bench.answer
        waiting.set_visibility(answer is None and bench.problem is None)
        problem.text = "" if bench.problem is None else message(bench.problem)
        if method.options != (options := _methods(bench)):
            method.set_options(options, value=bench.method)
        method.value = bench.method
        reference.set_visibility(METHODS[bench.method].needs_reference)
        if answer is not None:
            numbers.content = answer_html(answer, bench.command_name)

    refresh()
    method.on_value_change(choose)
    reference.on_value_change(choose)
    home.on_click(go_home)
    bench.answered.subscribe(refresh)
    bench.robot.changed.subscribe(refresh)


def _methods(bench: Workbench) -> dict[str, str]:
    """Titles of the methods that the robot takes, and of the chosen one in any case."""
    names = dict.fromkeys([*bench.questions.methods, bench.method])
    return {name: f"{name}: {METHODS[name].title}" for name in names}


def _place_sliders(bench: Workbench) -> Callable[[], None]:
    """Places a slider and a field for each coordinate; returns what has them follow the pose."""
    box = ui.element("div").classes("studio-sliders")
    axes: list[PoseAxis] = []
    sliders: list[ui.slider] = []

    def follow() -> None:
        if axes != bench.questions.axes:
            axes[:] = bench.questions.axes
            with box.clear():
                sliders[:] = [_place_slider(bench, k, axis) for k, axis in enumerate(axes)]
        for slider, value in zip(sliders, bench.coordinates, strict=True):
            slider.value = value

    return follow


def _place_slider(bench: Workbench, k: int, axis: PoseAxis) -> ui.slider:
    """Places slider and field of a coordinate; the field follows the slider, the pose both."""

    def refusal(words: Any) -> str | None:
        try:
            if axis.lower <= float(words) <= axis.upper:
                return None
        except (TypeError, ValueError):
            pass
        return (
            f"found {str(words)[:40]!r}; accepted: a number from {axis.lower:g} to {axis.upper:g} "
            f"[{axis.unit}]"
        )

    def moved() -> None:
        value = slider.value
        if value is not None and np.isfinite(value):
            field.value, field.error = _shown(value), None
            if value != bench.coordinates[k]:
                bench.move_to([*bench.coordinates[:k], value, *bench.coordinates[k + 1 :]])

    def typed() -> None:
        if field.value == _shown(slider.value):
            field.error = None
        elif field.validate():
            slider.value = float(field.value)

    step = 0.1 if axis.unit == "deg" else max((axis.upper - axis.lower) / 1000.0, 1e-6)
    value = bench.coordinates[k]
    ui.label(axis.name).classes("studio-axis").props["title"] = axis.words
    slider = ui.slider(min=axis.lower, max=axis.upper, step=step, value=value, on_change=moved)
    slider.props(f'aria-label="{axis.words} [{axis.unit}]" snap=false').mark(f"slider-{k}")
    slider.on("update:model-value", lambda event: slider.set_value(event.args), throttle=THROTTLE)
    field = ui.input(value=_shown(value), validation=refusal).without_auto_validation()
    field.props(f'suffix="{axis.unit}" aria-label="{axis.words}" hide-bottom-space')
    field.classes("studio-number").mark(f"coordinate-{k}")
    field.on("keydown.enter", typed).on("blur", typed)
    return slider


def _shown(value: float) -> str:
    return f"{round(value, 6) + 0.0:g}"


def answer_html(answer: PoseAnswer, name: str) -> str:
    """All numbers at a pose; commands know the robot by a name, empty: it is in no file."""
    rest, tensions = answer.rest, answer.why_no_tensions or f"{answer.status}, by {answer.method}"
    near = f", {answer.nearest}" if answer.nearest else ""
    angles = np.degrees(angles_from_rotation(answer.X_WP.rotation()))
    pose = ",".join(_shown(float(value)) for value in (*answer.X_WP.translation(), *angles))
    words = f"cdpr tension {shlex.quote(name) if name else 'FILE'} --pose={pose}"
    facts = [
        ("cables", answer.geometry),
        ("tensions", tensions),
        ("at rest", answer.why_no_rest if rest is None else f"{rest.stability}, elastic cables"),
        *(line.partition(": ")[::2] for line in (rest.lines() if rest is not None else ())),
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
    scale = _scale(tensions, high)
    ticks = "".join(
        f'<i class="tick" style="left:{100.0 * bound / scale:.2f}%"></i>'
        for bound in (low, high)
        if 0.0 < bound <= scale
    )
    none = np.full(len(robot.cables), np.nan)
    lengths = none if answer.lengths is None else answer.lengths
    at_rest, unstrained = (none, none) if rest is None else (rest.tensions, rest.l0)
    heads = "cable", "tension", "[N]", "state", "length [m]", "at rest [N]", "unstrained [m]"
    rows = ""
    for k, (cable, tension) in enumerate(zip(robot.cables, tensions, strict=True)):
        color, is_slack = nth_look(k).color, bool(answer.slack[k])
        # Comparisons with NaN are false.
        outside = tension < low - 1e-6 * scale or tension > high + 1e-6 * scale
        state = "slack" if is_slack else "out of limits" if outside else ""
        width = 100.0 * np.clip(np.nan_to_num(tension) / scale, 0.0, 1.0)
        rows += (
            f"<tr{' class=slack' if state else ''}>"
            f'<th scope="row"><i class="swatch" style="background:{color}"></i>'
            f"{escape(cable.name)}</th>"
            f'<td class="bar"><div><b style="width:{width:.2f}%;'
            f'background:{SLACK if is_slack else color}"></b>{ticks}</div></td>'
            f'<td>{number_words(tension, 2, "f")}</td><td class="mark">{state}</td>'
            f"<td>{number_words(lengths[k], 4, 'f')}</td>"
            f"<td>{number_words(at_rest[k], 2, 'f')}</td>"
            f"<td>{number_words(unstrained[k], 4, 'f')}</td></tr>"
        )
    top = "".join(f"<th>{head}</th>" for head in heads)
    beyond = "" if high <= scale else f"; {high:g} N is beyond the scale"
    return (
        f'<table class="studio-cables"><caption>tensions, limits {low:g} to {high:g} N{beyond}'
        f"</caption><thead><tr>{top}</tr></thead><tbody>{rows}</tbody></table>"
    )


def _scale(values: Array, upper: float) -> float:
    """Where bars end: a power of two above all values, which changes seldom as they do.

    It is not above the upper limit, unless a value is.
    """
    largest = float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0))
    if largest <= 0.0:
        return upper * OVER
    return min(2.0 ** ceil(log2(1.1 * largest)), max(upper, largest) * OVER)
