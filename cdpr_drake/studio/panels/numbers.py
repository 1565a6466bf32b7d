"""Numbers and bars as HTML: one element, so that a slider's step is one message to the browser."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from math import floor, inf, log10

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.palette import SLACK, nth_look
from cdpr_drake.studio.workbench.side_by_side import Pair

OVER = 1.08
"""How far a scale goes beyond the upper limit, so that one sees whether it is passed."""


def number_words(value: float | None, digits: int = 4) -> str:
    """A number with so many digits; a dash where there is none."""
    if value is None or not np.isfinite(value):
        return "–"
    return f"{value:.{digits}g}"


def bar_scale(values: Iterable[float], upper: float) -> float:
    """Where bars end: a round number above all values, which changes seldom as they do.

    It is not above the upper limit, unless a value is.
    """
    largest = max((abs(value) for value in values if np.isfinite(value)), default=0.0)
    if largest >= upper:
        return largest * OVER
    if largest <= 0.0:
        return upper * OVER
    power = 10.0 ** floor(log10(largest))
    for step in (1.0, 2.0, 5.0, 10.0):
        if largest * 1.1 <= step * power:
            return min(step * power, upper * OVER)
    return upper * OVER


def cable_table(
    names: Sequence[str],
    tensions: Array,
    limits: tuple[float, float],
    slack: np.ndarray,
    columns: Mapping[str, Sequence[str]],
) -> str:
    """A table of cables: colour, name, tension as a bar between its limits, and other columns.

    Args:
        names: Of the cables.
        tensions: Shape (m,) [N]; NaN where there is none.
        limits: Smallest and largest tension [N].
        slack: Which cables are slack, shape (m,).
        columns: Words for each cable, by heading.
    """
    low, high = limits
    scale = bar_scale(tensions, high if np.isfinite(high) else inf)
    heads = "".join(f"<th>{escape(head)}</th>" for head in columns)
    beyond = "" if high <= scale else f"; {high:g} N is beyond the scale"
    rows = []
    for k, name in enumerate(names):
        color, value = nth_look(k).color, float(tensions[k])
        is_slack, is_known = bool(slack[k]), bool(np.isfinite(value))
        outside = is_known and not low - 1e-6 * scale <= value <= high + 1e-6 * scale
        mark = "slack" if is_slack else "out of limits" if outside else ""
        width = 100.0 * min(max(value, 0.0) / scale, 1.0) if is_known else 0.0
        ticks = "".join(
            f'<i class="tick" style="left:{100.0 * bound / scale:.2f}%"></i>'
            for bound in (low, high)
            if 0.0 < bound <= scale
        )
        cells = "".join(f"<td>{escape(words[k])}</td>" for words in columns.values())
        rows.append(
            f"<tr{' class=slack' if is_slack or outside else ''}>"
            f'<th scope="row"><i class="swatch" style="background:{color}"></i>'
            f"{escape(name)}</th>"
            f'<td class="bar"><div><b style="width:{width:.2f}%;'
            f'background:{SLACK if is_slack else color}"></b>{ticks}</div></td>'
            f"<td>{f'{value:.2f}' if is_known else '–'}</td>"
            f'<td class="mark">{mark}</td>{cells}</tr>'
        )
    return (
        f'<table class="studio-cables"><caption>tensions, limits {low:g} to {high:g} N{beyond}'
        "</caption><thead><tr><th>cable</th>"
        f"<th>tension</th><th>[N]</th><th>state</th>{heads}</tr>"
        f"</thead><tbody>{''.join(rows)}</tbody></table>"
    )


def fact_table(facts: Mapping[str, str]) -> str:
    """Facts by what they are, in two columns."""
    return fact_rows(facts.items())


def plain_table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of words, the first of each row its name."""
    top = "".join(f'<th scope="col">{escape(words)}</th>' for words in heads)
    body = "".join(
        f'<tr><th scope="row">{escape(row[0])}</th>'
        + "".join(f"<td>{escape(words)}</td>" for words in row[1:])
        + "</tr>"
        for row in rows
    )
    return (
        '<div class="studio-wide" tabindex="0" role="group" aria-label="Table"><table '
        f'class="studio-facts"><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table></div>'
    )


def pair_table(pairs: Iterable[Pair], one: str, other: str) -> str:
    """Two robots or runs beside each other, with differences; both have a name."""
    rows = [
        (pair.name, _either(pair.one), _either(pair.other), _signed(pair.difference))
        for pair in pairs
    ]
    return plain_table(("what", one, other, "difference"), rows)


def _either(value: float | str | None) -> str:
    return value if isinstance(value, str) else number_words(value, 6)


def _signed(value: float | None) -> str:
    return "" if value is None else "0" if value == 0.0 else f"{value:+.4g}"


def fact_rows(facts: Iterable[tuple[str, str]]) -> str:
    """Facts in two columns; the same name may be there twice."""
    rows = "".join(
        f'<tr><th scope="row">{escape(name)}</th><td>{escape(words)}</td></tr>'
        for name, words in facts
    )
    return f'<table class="studio-facts"><tbody>{rows}</tbody></table>'
