"""What was published, line by line, beside what studies found."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from cdpr_drake.analyses.reporting.statements import CONFIRMED, IN_PART, NOT_CONFIRMED, NOT_IN_QUICK
from cdpr_drake.analyses.reproduction.numbers import judge_number
from cdpr_drake.analyses.reproduction.states import (
    FAILED as STUDY_FAILED,
)
from cdpr_drake.analyses.reproduction.states import (
    FINISHED,
    StudyState,
    read_results,
    study_folder,
)
from cdpr_drake.analyses.studies.catalogue import StudyEntry
from cdpr_drake.analyses.studies.framework.case_definition import PublishedNumber
from cdpr_drake.analyses.studies.framework.statement import (
    MET_CONSTRUCTION,
    MET_FITTED,
    TEST,
)
from cdpr_drake.analyses.studies.published.register import PublishedItem, PublishedSection, Register
from cdpr_drake.systems.cameras.camera_settings import PROJECTED

SHOWN = "shown"
"""A figure that is drawn here, too, and of which nothing is judged."""
MISSING = "missing"
"""No run answers it."""
CITED = "cited"
"""Told of the work of others; the source did and compared nothing."""
FAILED = "study failed"
NOT_FINISHED = "not finished"
NOT_ASKED = "not asked for"
"""The study that answers it was not among those to be run."""

_GOOD = (CONFIRMED, MET_FITTED, MET_CONSTRUCTION)
_JUDGED = (*_GOOD, IN_PART, NOT_CONFIRMED)


@dataclass(frozen=True)
class Fact:
    """What one check found, or one printed number; rows that rest on it may be several.

    Attributes:
        key: "study/check", or "study/configuration/metric".
        verdict: What came of it.
        basis: What it rests on, see `framework.statement`.
        rule: What had to be within which bounds.
        cause: Why it does not hold, see `framework.statement`; empty: it does, or nobody knows.
        says: What it is about, in words; empty where nothing was found.
        printed: Its numbers.
        found: Ours.
        why: What is known of the difference.
    """

    key: str
    verdict: str
    basis: str = TEST
    rule: str = ""
    cause: str = ""
    says: str = ""
    printed: str = ""
    found: str = ""
    why: str = ""


@dataclass(frozen=True)
class ReportRow:
    """One published figure, table, number or statement.

    Attributes:
        source: Name of the register.
        chapter: Of the source.
        section: Of the source.
        label: Number of the figure or table, "number" or "statement".
        words: What it shows or says.
        printed: Its numbers.
        found: Ours.
        verdict: Of `reporting`, or SHOWN, MISSING, CITED, FAILED, NOT_FINISHED, NOT_ASKED.
        why: What is known of the difference, or why there is no verdict.
        lacks: What of it no run answers; may be empty.
        studies: Which studies answer it.
        figures: Files of figures that show it, below the reproduction's folder.
        differs: By what these differ from the published one; may be empty.
        facts: What it rests on.
        repeats: Whether rows before it rest on all of these already.
    """

    source: str
    chapter: str
    section: str
    label: str
    words: str
    printed: str
    found: str
    verdict: str
    why: str
    lacks: str = ""
    studies: tuple[str, ...] = ()
    figures: tuple[str, ...] = ()
    differs: str = ""
    facts: tuple[Fact, ...] = ()
    repeats: bool = False

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


@dataclass(frozen=True)
class _Answer:
    """What is known of a key "study/statement"."""

    verdict: str
    words: str = ""
    printed: str = ""
    found: str = ""
    why: str = ""
    basis: str = TEST
    rule: str = ""
    same_as: str = ""
    cause: str = ""

    def fact(self, key: str) -> Fact:
        """It as a fact, under the key where it is judged first."""
        return Fact(
            self.same_as or key, self.verdict, self.basis, self.rule, self.cause, self.words,
            self.printed, self.found, self.why,
        )  # fmt: skip


class _Found:
    """Results of the studies of a reproduction, as their files have them."""

    def __init__(
        self, folder: Path, studies: Mapping[str, StudyEntry], states: Mapping[str, StudyState]
    ) -> None:
        self.folder, self.studies, self.states = folder, studies, states
        self._results: dict[str, dict[str, Any]] = {}

    def results(self, study: str) -> dict[str, Any]:
        """What a study wrote; empty where it wrote nothing."""
        if study not in self._results:
            there = read_results(self.folder, study) if study in self.states else None
            self._results[study] = there or {}
        return self._results[study]

    def lack(self, study: str) -> _Answer:
        """Why a study that has no answer has none."""
        state = self.states.get(study)
        if study not in self.studies:
            return _Answer(NOT_ASKED, why=f"cdpr reproduce --only {study}")
        if state is None or state.status not in (FINISHED, STUDY_FAILED):
            return _Answer(NOT_FINISHED, why="the same command goes on with it")
        if state.status == STUDY_FAILED:
            return _Answer(FAILED, why=state.error)
        if state.quick:
            return _Answer(NOT_IN_QUICK, why="its runs are those of the full form")
        return _Answer(MISSING, why="no run of the study supports it")

    def answer(self, key: str) -> _Answer:
        """What is known of a statement."""
        study, _, name = key.partition("/")
        for said in self.results(study).get("statements", ()):
            if said.get("name") != name:
                continue
            if said["verdict"] == NOT_IN_QUICK:
                return replace(self.lack(study), words=said["words"])
            return self.said(said)
        return self.lack(study)

    def said(self, said: Mapping[str, Any]) -> _Answer:
        """What a statement of a study's results says; what a fact that is judged elsewhere too
        rests on is said there."""
        answer = _Answer(
            said["verdict"], said["words"], said["printed"], said["found"], said["why"],
            said.get("basis", TEST), said.get("rule", ""), said.get("same_as", ""),
            said.get("cause", ""),
        )  # fmt: skip
        if answer.same_as:
            study, _, name = answer.same_as.partition("/")
            for first in self.results(study).get("statements", ()):
                if first.get("name") == name:
                    return replace(answer, basis=first.get("basis", TEST))
        return answer

    def figure(self, key: str) -> str | None:
        """Path of a figure below the folder; None where it was not drawn."""
        study, _, name = key.partition("/")
        path = study_folder(self.folder, study) / f"{name}.png"
        there = study in self.states and path.is_file()
        return path.relative_to(self.folder).as_posix() if there else None


def report_rows(
    registers: Sequence[Register],
    folder: Path,
    studies: Mapping[str, StudyEntry],
    states: Mapping[str, StudyState],
) -> list[ReportRow]:
    """Every published item of some registers, in their order.

    Args:
        registers: What was published.
        folder: A reproduction's.
        studies: Those that were to be run.
        states: How far they are.
    """
    found = _Found(folder, studies, states)
    rows = []
    for register in registers:
        for section in register.sections:
            rows += [_item(register, section, item, found) for item in section.items]
            for key in section.numbers:
                rows += _numbers(register, section, key, found)
        for study in register.own:
            rows += _own(register, study, found)
    return _marked(rows)


def _marked(rows: Sequence[ReportRow]) -> list[ReportRow]:
    """Rows, those marked that rest on nothing but what rows before them rest on."""
    seen: set[str] = set()
    marked = []
    for row in rows:
        keys = {fact.key for fact in row.facts}
        marked.append(replace(row, repeats=bool(keys) and keys <= seen))
        seen |= keys
    return marked


def _item(
    register: Register, section: PublishedSection, item: PublishedItem, found: _Found
) -> ReportRow:
    answers = {key: found.answer(key) for key in item.answers}
    figures = [path for path in map(found.figure, item.figures) if path is not None]
    studies = dict.fromkeys(key.partition("/")[0] for key in (*item.answers, *item.figures))
    one = next(iter(answers.values())) if len(answers) == 1 else None
    if one is not None and item.label == "statement":
        words = item.says or one.words or _spoken(item.answers[0])
        answer = one
    else:
        words, answer = item.says, _together(item, answers, figures, found)
    why, undrawn = answer.why, _undrawn(item, figures, found)
    if undrawn:
        why = f"{why.rstrip('.')}; {undrawn}" if why else undrawn
    numbers = _numbers_of_figure(section, item, found)
    return ReportRow(
        register.name, section.chapter, section.number, item.label, words,
        _joined(answer.printed, numbers[0]), _joined(answer.found, numbers[1]), answer.verdict,
        why, item.missing, tuple(studies), tuple(figures), item.differs,
        tuple(one.fact(key) for key, one in answers.items()),
    )  # fmt: skip


def _joined(first: str, second: str) -> str:
    return "; ".join(part.rstrip(".") for part in (first, second) if part)


MOST_NUMBERS = 4
"""So many printed numbers of its runs stand beside a figure; all have rows of their own below."""


def _numbers_of_figure(
    section: PublishedSection, item: PublishedItem, found: _Found
) -> tuple[str, str]:
    """What is printed in a section of the runs that a figure of it draws, and ours, in words.

    They are judged in rows of their own, not with the figure.
    """
    if not item.label.startswith("Figure"):
        return "", ""
    drawn = dict.fromkeys(key.partition("/")[0] for key in item.figures)
    printed, ours = [], []
    for key in section.numbers:
        if key.partition("/")[0] not in drawn:
            continue
        for number, rows in _numbers_and_runs(key, found):
            what = f"{number.label}, {number.heading}"
            printed.append(f"{what}: {number.printed}")
            if rows:
                ours.append(f"{what}: {judge_number(number, rows)[0]}")
    return _first(printed), _first(ours)


def _first(words: Sequence[str]) -> str:
    left = len(words) - MOST_NUMBERS
    return "; ".join(words[:MOST_NUMBERS]) + (f"; {left} more below" if left > 0 else "")


def _undrawn(item: PublishedItem, figures: Sequence[str], found: _Found) -> str:
    """Why a judged item's figure is not there though its study is finished; else empty."""
    if figures or not item.figures or not item.answers:
        return ""
    state = found.states.get(item.figures[0].partition("/")[0])
    if state is None or state.status != FINISHED:
        return ""
    return "its figure is of runs of the full form" if state.quick else "its figure was not drawn"


def _together(
    item: PublishedItem, answers: Mapping[str, _Answer], figures: Sequence[str], found: _Found
) -> _Answer:
    """One answer of several, or of figures alone."""
    if item.cited:
        return _Answer(CITED, why=item.cited)
    verdicts = [answer.verdict for answer in answers.values()]
    judged = [verdict for verdict in verdicts if verdict in _JUDGED]
    words = "; ".join(
        f"{_spoken(key)}: {answer.verdict}" + (f", {answer.found}" if answer.found else "")
        for key, answer in answers.items()
    )
    printed = "; ".join(
        f"{_spoken(key)}: {answer.printed}" if len(answers) > 1 else answer.printed
        for key, answer in answers.items()
        if answer.printed
    )
    if judged:
        # What is left to judge may spoil a confirmation, but makes none of what was not confirmed.
        left = len(judged) < len(verdicts)
        good = all(verdict in _GOOD for verdict in judged)
        alike = (good or len(set(judged)) == 1) and not (left and good)
        # All of it holds as well as the weakest of its parts does.
        whole = max(judged, key=_JUDGED.index) if alike else IN_PART
        return _Answer(whole, printed=printed, found=words, why=_reasons(answers))
    if verdicts:
        why = next(iter(answers.values())).why
        return _Answer(verdicts[0], printed=printed, found=words, why=why)
    if figures:
        return _Answer(SHOWN)
    if item.figures:
        return found.lack(item.figures[0].partition("/")[0])
    return _Answer(MISSING)


def _reasons(answers: Mapping[str, _Answer]) -> str:
    """Why parts of an item are not confirmed, as their statements say, and what is left."""
    reasons = [
        f"{_spoken(key)}: {answer.why or 'see its statement'}"
        for key, answer in answers.items()
        if answer.verdict in (IN_PART, NOT_CONFIRMED)
    ]
    left = [_spoken(key) for key, answer in answers.items() if answer.verdict not in _JUDGED]
    if left:
        reasons.append(f"without a verdict here: {', '.join(left)}")
    return " ".join(one if one.endswith(".") else f"{one}." for one in reasons)


def _spoken(key: str) -> str:
    """Words for a key whose statement is not there."""
    return key.partition("/")[2].replace("_", " ")


def _numbers(
    register: Register, section: PublishedSection, key: str, found: _Found
) -> Iterator[ReportRow]:
    """The printed numbers of a case study, or of one of its groups."""
    study = key.partition("/")[0]
    if study not in found.studies:
        lack = found.lack(study)
        yield ReportRow(
            register.name, section.chapter, section.number, "numbers", f"Numbers of {key}", "", "",
            lack.verdict, lack.why, studies=(study,),
        )  # fmt: skip
        return
    for number, ours in _numbers_and_runs(key, found):
        if ours:
            words, verdict, why = judge_number(number, ours)
        else:
            lack = found.lack(study)
            words, verdict, why = "", lack.verdict, lack.why
        cause = number.cause if verdict in (IN_PART, NOT_CONFIRMED) else ""
        says = f"{number.label}: {number.heading}"
        fact = Fact(
            f"{study}/{number.configuration}/{number.metric}", verdict, cause=cause, says=says,
            printed=number.printed, found=words, why=why,
        )  # fmt: skip
        yield ReportRow(
            register.name, section.chapter, section.number, "number", says, number.printed, words,
            verdict, why, studies=(study,), facts=(fact,),
        )  # fmt: skip


def _numbers_and_runs(
    key: str, found: _Found
) -> Iterator[tuple[PublishedNumber, list[Mapping[str, Any]]]]:
    """Printed numbers of a study or of one of its groups, each with the runs that it is about."""
    study, _, group = key.partition("/")
    entry = found.studies.get(study)
    rows = [row for row in found.results(study).get("runs", ()) if row["camera"] == PROJECTED]
    for number in () if entry is None else entry.numbers:
        if not group or number.group == group:
            yield number, [row for row in rows if row["configuration"] == number.configuration]


def _own(register: Register, study: str, found: _Found) -> Iterator[ReportRow]:
    """The statements of a study that are of no source."""
    if study not in found.studies:
        return
    said = found.results(study).get("statements", ())
    if not said:
        lack = found.lack(study)
        yield ReportRow(
            register.name, study, study, "statements", f"What {study} has to show", "", "",
            lack.verdict, lack.why, studies=(study,),
        )  # fmt: skip
    for one in said:
        yield ReportRow(
            register.name, study, study, "statement", one["words"], one["printed"], one["found"],
            one["verdict"], one["why"], studies=(study,),
            facts=(found.said(one).fact(f"{study}/{one.get('name') or one['words']}"),),
        )  # fmt: skip
