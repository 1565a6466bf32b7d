"""Numbers as HTML: one element for a table, so that a change is one message to the browser."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

import numpy as np

from cdpr_drake.studio.side_by_side import Pair


def number_words(value: float | None, digits: int = 4, kind: str = "g") -> str:
    """A number with so many digits, or decimals if its kind is f; a dash where there is none."""
    return "–" if value is None or not np.isfinite(value) else f"{value:.{digits}{kind}}"


def fact_rows(facts: Iterable[Sequence[str]]) -> str:
    """Facts in two columns; the same name may be there twice."""
    rows = "".join(
        f'<tr><th scope="row">{escape(name)}</th><td>{escape(words)}</td></tr>'
        for name, words in facts
    )
    return f'<table class="studio-facts"><tbody>{rows}</tbody></table>'


def plain_table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of words, the first of each row its name."""
    top = "".join(f'<th scope="col">{escape(words)}</th>' for words in heads)
    body = "".join(
        f'<tr><th scope="row">{escape(name)}</th>'
        + "".join(f"<td>{escape(words)}</td>" for words in cells)
        + "</tr>"
        for name, *cells in rows
    )
    return (
        '<div class="studio-wide" tabindex="0" role="group" aria-label="Table"><table '
        f'class="studio-facts"><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table></div>'
    )


def pair_table(pairs: Iterable[Pair], one: str, other: str) -> str:
    """Two robots or runs beside each other, with differences; both have a name."""

    def words(value: float | str | None) -> str:
        return value if isinstance(value, str) else number_words(value, 6)

    def signed(value: float | None) -> str:
        return "" if value is None else "0" if value == 0.0 else f"{value:+.4g}"

    return plain_table(
        ("what", one, other, "difference"),
        ((pair.name, words(pair.one), words(pair.other), signed(pair.difference))
         for pair in pairs),
    )  # fmt: skip
