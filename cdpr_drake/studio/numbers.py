"""Numbers as HTML, also those of two robots or runs beside each other.

There is one element for a table, so that a change is one message to the browser.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from typing import Any, NamedTuple

import numpy as np

from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.declarations import settings_of
from cdpr_drake.studio.pose_answer import PoseAnswer, RobotQuestions

Value = float | str | None


class Pair(NamedTuple):
    """A name with its unit, and the number or word of each of two; None: it has none."""

    name: str
    one: Value
    other: Value

    @property
    def difference(self) -> float | None:
        """The second minus the first; None where they are no numbers."""
        if isinstance(self.one, float) and isinstance(self.other, float):
            return self.other - self.one
        return None


def number_words(value: float | None, digits: int = 4, kind: str = "g") -> str:
    """A number with so many digits, or decimals if its kind is f; a dash where there is none."""
    return "–" if value is None or not np.isfinite(value) else f"{value:.{digits}{kind}}"


def fact_rows(facts: Iterable[Sequence[str]]) -> str:
    """Facts in two columns; the same name may be there twice."""
    return f'<table class="studio-facts">{_body(facts)}</table>'


def plain_table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of words, the first of each row its name."""
    top = "".join(f'<th scope="col">{escape(words)}</th>' for words in heads)
    return (
        '<div class="studio-wide" tabindex="0" role="group" aria-label="Table"><table '
        f'class="studio-facts"><thead><tr>{top}</tr></thead>{_body(rows)}</table></div>'
    )


def _body(rows: Iterable[Sequence[str]]) -> str:
    body = ""
    for name, *cells in rows:
        inner = "".join(f"<td>{escape(words)}</td>" for words in cells)
        body += f'<tr><th scope="row">{escape(name)}</th>{inner}</tr>'
    return f"<tbody>{body}</tbody>"


def pair_table(pairs: Iterable[Pair], one: str, other: str) -> str:
    """Two robots or runs beside each other, with differences; both have a name."""

    def words(value: Value) -> str:
        return value if isinstance(value, str) else number_words(value, 6)

    def signed(value: float | None) -> str:
        return "" if value is None else "0" if value == 0.0 else f"{value:+.4g}"

    rows = ((x.name, words(x.one), words(x.other), signed(x.difference)) for x in pairs)
    return plain_table(("what", one, other, "difference"), rows)


def pairs(one: Mapping[str, Value], other: Mapping[str, Value]) -> list[Pair]:
    """Pairs of what two have by name, in the order of the first; not what both have not."""
    both = [Pair(name, one.get(name), other.get(name)) for name in {**one, **other}]
    return [pair for pair in both if pair[1:] != (None, None)]


def robots_side_by_side(one: Robot, other: Robot) -> list[Pair]:
    """Fields of their files in which two robots differ, then what is known at their home poses."""
    fields = pairs(dict(_fields(one, "")), dict(_fields(other, "")))
    home = pairs(dict(_at_home(one)), dict(_at_home(other)))
    return [*(pair for pair in fields if pair.one != pair.other), *home]


def _fields(settings: Any, before: str) -> Iterator[tuple[str, Value]]:
    """Numbers and words of settings, with units and axes."""
    for name, rule in settings_of(type(settings)).items():
        value = getattr(settings, name)
        words = f"{before} {name.replace('_', ' ')}".strip()
        unit = f" [{rule.unit}]" if rule.unit not in ("", "-") else ""
        if value is None:
            continue
        if rule.kind == "section":
            yield from _fields(value, words)
        elif rule.kind == "sections":
            for k, item in enumerate(value):
                yield from _fields(item, f"{words} {k + 1}")
        elif rule.kind == "array":
            axes = "xyz" if rule.shape == (3,) else map(str, range(1, len(value) + 1))
            for axis, number in zip(axes, value, strict=True):
                yield f"{words} {axis}{unit}", float(number)
        else:
            yield f"{words}{unit}", float(value) if rule.kind in ("number", "whole") else str(value)


def _at_home(robot: Robot) -> Iterator[tuple[str, Value]]:
    answer = PoseAnswer(RobotQuestions(robot), robot.home.transform())
    tensions = answer.tensions[np.isfinite(answer.tensions)]
    if len(tensions):
        yield "at home: least tension [N]", float(tensions.min())
        yield "at home: largest tension [N]", float(tensions.max())
    if answer.rest is not None:
        name = f"at home: least stiffness [N/m], turns times {answer.rest.arm:.3g} m"
        yield name, float(np.min(answer.rest.principal))
        if answer.rest.frequencies is not None:
            yield "at home: lowest frequency [Hz]", float(np.min(answer.rest.frequencies))
    yield "at home: capacity margin [N]", answer.capacity_margin
    yield "at home: clearance [m]", answer.clearance
