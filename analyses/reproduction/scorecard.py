"""How many facts and published items have which verdict, by source and chapter.

A fact is one check of a study, or one printed number. Several figures, tables and sentences may
rest on one: they are items, and the fact is counted once, where it comes first.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
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
from cdpr_drake.analyses.studies.framework.statement import (
    MET_CONSTRUCTION,
    MET_FITTED,
    OURS,
    TEST,
)
from cdpr_drake.analyses.visualization.figure_style import bar_style, new_figure
from cdpr_drake.palette import look_of

VERDICTS = (
    CONFIRMED, MET_FITTED, MET_CONSTRUCTION, IN_PART, NOT_CONFIRMED, NOT_TESTABLE, SHOWN,
    NOT_JUDGED, CITED, NOT_IN_QUICK, MISSING, FAILED, NOT_FINISHED, NOT_ASKED,
)  # fmt: skip
"""All verdicts, in the order of the columns."""

OWN = "ours"
"""Register of what no source states."""


@dataclass(frozen=True)
class Scorecard:
    """Counts of verdicts.

    Attributes:
        chapters: Of items, by source and chapter, in their order.
        facts: Of facts, by source and chapter where they come first; what no source states, but we
            ask for, is under the source `OWN`.
        independent: Facts of the sources that were confirmed by runs that could have said
            otherwise.
    """

    chapters: dict[tuple[str, str], Counter[str]]
    facts: dict[tuple[str, str], Counter[str]]
    independent: int

    @classmethod
    def of(cls, rows: Sequence[ReportRow]) -> Scorecard:
        """Counts rows, and what they rest on."""
        chapters: dict[tuple[str, str], Counter[str]] = {}
        facts: dict[tuple[str, str], Counter[str]] = {}
        seen: set[str] = set()
        independent = 0
        for row in rows:
            chapters.setdefault((row.source, row.chapter), Counter())[row.verdict] += 1
            for fact in row.facts:
                if fact.key in seen:
                    continue
                seen.add(fact.key)
                own = row.source == OWN or fact.basis == OURS
                key = (OWN, fact.key.partition("/")[0]) if own else (row.source, row.chapter)
                facts.setdefault(key, Counter())[fact.verdict] += 1
                independent += not own and fact.basis == TEST and fact.verdict == CONFIRMED
        return cls(chapters, facts, independent)

    def total(self, source: str | None = None) -> Counter[str]:
        """Counts of the items of a source, or of all."""
        return _sum(self.chapters, source)

    def total_facts(self, source: str | None = None) -> Counter[str]:
        """Counts of the facts of a source; of all but `OWN` without."""
        if source is not None:
            return _sum(self.facts, source)
        return _sum({key: some for key, some in self.facts.items() if key[0] != OWN}, None)

    def shown(self) -> tuple[str, ...]:
        """The verdicts of items that occur."""
        return tuple(verdict for verdict in VERDICTS if self.total()[verdict])

    def shown_facts(self) -> tuple[str, ...]:
        """The verdicts of facts that occur."""
        every = _sum(self.facts, None)
        return tuple(verdict for verdict in VERDICTS if every[verdict])

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "facts": {
                "sources": dict(self.total_facts()),
                "independent": self.independent,
                "ours": dict(self.total_facts(OWN)),
                "chapters": [
                    {"source": source, "chapter": chapter, **counts}
                    for (source, chapter), counts in self.facts.items()
                ],
            },
            "all": dict(self.total()),
            "chapters": [
                {"source": source, "chapter": chapter, **counts}
                for (source, chapter), counts in self.chapters.items()
            ],
        }


def _sum(counts: Mapping[tuple[str, str], Counter[str]], source: str | None) -> Counter[str]:
    return sum((some for (name, _), some in counts.items() if source in (None, name)), Counter())


def scorecard_figure(card: Scorecard) -> Figure:
    """Facts by verdict as bars, a row for each chapter."""
    names = [f"{source.replace('_', ' ')}, {chapter}" for source, chapter in card.facts]
    height = 1.8 + 0.4 * len(names)
    figure, axes = new_figure(1, 1, (11.0, height), "What was published, repeated")
    rows, begin = np.arange(len(names)), np.zeros(len(names))
    for verdict in card.shown_facts():
        counts = np.array([float(some[verdict]) for some in card.facts.values()])
        look = look_of(verdict, list(VERDICTS))
        axes.barh(rows, counts, left=begin, label=verdict, **bar_style(look))
        begin += counts
    axes.set_yticks(rows, names)
    axes.invert_yaxis()
    axes.set(xlabel="distinct facts")
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    return figure
