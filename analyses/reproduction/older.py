"""An older report, beside which a new one is shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from cdpr_drake.analyses.reproduction.overview import PlacedFact, first_rows
from cdpr_drake.analyses.reproduction.rows import ReportRow
from cdpr_drake.analyses.reproduction.scorecard import VERDICTS, Scorecard, facts_by_place
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.schema.json_text import load_json

SUMMARY = "summary.json"
"""All rows and counts of a report, beside its page."""


@dataclass(frozen=True)
class OlderReport:
    """What another report counted.

    Attributes:
        code: Version of the code that made it.
        quick: Whether its studies were run in their quick form.
        card: Its counts; reports that did not count facts yet have none of these.
        verdicts: Of each fact, by its key.
    """

    code: str
    quick: bool
    card: Scorecard
    verdicts: dict[str, str] = field(default_factory=dict)

    @property
    def words(self) -> str:
        """What it is."""
        return f"the report by code {self.code}, {'quick' if self.quick else 'full'} form"


def either(now: Sequence[str], before: Sequence[str]) -> tuple[str, ...]:
    """Verdicts that occur now or did before, in the order of the columns."""
    return tuple(verdict for verdict in VERDICTS if verdict in {*now, *before})


@dataclass(frozen=True)
class ChangedFact:
    """A fact of which now comes something else.

    Attributes:
        placed: The fact as it is now.
        before: Its verdict in the older report.
    """

    placed: PlacedFact
    before: str


def read_older(path: Path) -> OlderReport:
    """Reads the summary of a report.

    Args:
        path: The folder of `cdpr reproduce`, or the summary.json in it.

    Raises:
        OutputFolderError: It is not there, or no such summary.
    """
    file = path / SUMMARY if path.is_dir() else path
    try:
        content = load_json(file.read_text(encoding="utf-8"))
        facts = [fact for item in content["items"] for fact in item.get("facts", ())]
        return OlderReport(
            code=str(content["code"]),
            quick=bool(content["quick"]),
            card=Scorecard.from_dict(content["scorecard"]),
            verdicts={str(fact["key"]): str(fact["verdict"]) for fact in facts},
        )
    except OSError as problem:
        raise OutputFolderError(
            f"{file}: cannot be read: {problem.strerror}; accepted: a folder of cdpr reproduce, or "
            f"the {SUMMARY} in it"
        ) from problem
    except (ValueError, KeyError, TypeError, AttributeError) as problem:
        raise OutputFolderError(
            f"{file}: found no summary of a report; accepted: a folder of cdpr reproduce, or the "
            f"{SUMMARY} in it"
        ) from problem


def changed_facts(rows: Sequence[ReportRow], older: OlderReport) -> list[ChangedFact]:
    """Facts whose verdict is another one than before, in the order of the report."""
    first = first_rows(rows)
    return [
        ChangedFact(PlacedFact(fact, first[fact.key]), older.verdicts[fact.key])
        for facts in facts_by_place(rows).values()
        for fact in facts
        if older.verdicts.get(fact.key, fact.verdict) != fact.verdict
    ]


def change_words(rows: Sequence[ReportRow], older: OlderReport) -> str:
    """How many facts changed, are new, or gone, in words."""
    if not older.verdicts:
        return f"Beside {older.words}, which counted items and not yet facts."
    now = {fact.key for some in facts_by_place(rows).values() for fact in some}
    new, gone = len(now - set(older.verdicts)), len(set(older.verdicts) - now)
    return (
        f"Beside {older.words}: {len(changed_facts(rows, older))} facts have another verdict, "
        f"{new} are new, {gone} are there no more."
    )
