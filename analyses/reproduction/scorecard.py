"""How many published items have which verdict, by source and chapter."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.reporting.statements import (
    CONFIRMED,
    IN_PART,
    NOT_CONFIRMED,
    NOT_IN_QUICK,
    NOT_JUDGED,
    NOT_TESTABLE,
)
from cdpr_drake.analyses.reproduction.rows import (
    CITED,
    FAILED,
    MISSING,
    NOT_ASKED,
    NOT_FINISHED,
    SHOWN,
    ReportRow,
)
from cdpr_drake.analyses.visualization.figure_style import bar_style, new_figure
from cdpr_drake.palette import look_of

VERDICTS = (
    CONFIRMED, IN_PART, NOT_CONFIRMED, NOT_TESTABLE, SHOWN, NOT_JUDGED, CITED, NOT_IN_QUICK,
    MISSING, FAILED, NOT_FINISHED, NOT_ASKED,
)  # fmt: skip
"""All verdicts, in the order of the columns."""


@dataclass(frozen=True)
class Scorecard:
    """Counts of verdicts.

    Attributes:
        chapters: By source and chapter, in their order.
    """

    chapters: dict[tuple[str, str], Counter[str]]

    @classmethod
    def of(cls, rows: Sequence[ReportRow]) -> Scorecard:
        """Counts rows."""
        chapters: dict[tuple[str, str], Counter[str]] = {}
        for row in rows:
            chapters.setdefault((row.source, row.chapter), Counter())[row.verdict] += 1
        return cls(chapters)

    def total(self, source: str | None = None) -> Counter[str]:
        """Counts of a source, or of all."""
        return sum(
            (some for (name, _), some in self.chapters.items() if source in (None, name)),
            Counter(),
        )

    def shown(self) -> tuple[str, ...]:
        """The verdicts that occur."""
        return tuple(verdict for verdict in VERDICTS if self.total()[verdict])

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "all": dict(self.total()),
            "chapters": [
                {"source": source, "chapter": chapter, **counts}
                for (source, chapter), counts in self.chapters.items()
            ],
        }


def scorecard_figure(card: Scorecard) -> Figure:
    """Counts of verdicts as bars, a row for each chapter."""
    names = [f"{source.replace('_', ' ')}, {chapter}" for source, chapter in card.chapters]
    height = 1.8 + 0.4 * len(names)
    figure, axes = new_figure(1, 1, (11.0, height), "What was published, repeated")
    rows, begin = np.arange(len(names)), np.zeros(len(names))
    for verdict in card.shown():
        counts = np.array([float(some[verdict]) for some in card.chapters.values()])
        look = look_of(verdict, list(VERDICTS))
        axes.barh(rows, counts, left=begin, label=verdict, **bar_style(look))
        begin += counts
    axes.set_yticks(rows, names)
    axes.invert_yaxis()
    axes.set(xlabel="items")
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    return figure
