"""What sources print, as data: facts, and the comparisons that judge them by rows of studies.

A fact is one sentence or number of a source, with all places where it is printed. Each of its parts
selects a quantity of some rows and compares it in the unit of the print. A bound is written as a
bound. What a verdict rests on, and why a fact does not hold, is told with its reason. All parts
hold: confirmed, or met where the basis is weaker; some hold: in part; none: not confirmed.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
import pandas as pd
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from cdpr_drake.errors import CdprError
from cdpr_drake.schema.yaml_files import YamlTextError, load_yaml

Frame: TypeAlias = pd.DataFrame

Find = Callable[[Frame], tuple[Iterable[bool], str]]
"""Judges a fact that is no comparison: gives of each part whether it holds, and words."""

FOLDER = Path(__file__).parent / "facts"

Basis = Literal["independent", "ours", "fitted", "by construction"]
GOOD: Mapping[Basis, str] = {
    "independent": "confirmed", "ours": "confirmed", "fitted": "met (fitted)",
    "by construction": "met (by construction)",
}  # fmt: skip
"""Verdicts of facts all of whose parts hold, by what they rest on: runs that could have said
otherwise; what we ask for; parameters chosen with the number in sight; a definition."""

FACTORS = {
    "mm": 1e3, "cm": 1e2, "um": 1e6, "deg": 180.0 / np.pi, "ms": 1e3, "us": 1e6, "%": 100.0,
    "mm/s": 1e3, "deg/s": 180.0 / np.pi,
}  # fmt: skip
"""From the SI unit of a column to the unit of the print."""

UNIT_WORDS = {
    "m": "m", "rad": "rad", "deg": "deg", "px": "px", "s": "s", "us": "us", "n": "N",
    "percent": "%",
}  # fmt: skip
"""Units by the last word of a column's name."""

UNITS_OF_PRINTS = (*FACTORS, *dict.fromkeys(UNIT_WORDS.values()), "N^2", "m^2", "m^3", "1/m")
"""What `unit` may be; those without a factor are the columns' own."""

OVER: Mapping[str, Callable[[Any], Any]] = {
    "mean": np.mean, "median": np.median, "max": np.max, "min": np.min, "sum": np.sum,
    "rms": lambda values: np.sqrt(np.mean(np.square(values))),
    "drop": lambda values: values[0] - values[-1],
}  # fmt: skip
"""What makes one number of several rows."""

BOUNDS: Mapping[str, Callable[[float, float], bool]] = {
    "at_most": lambda a, b: a <= b, "at_least": lambda a, b: a >= b,
    "below": lambda a, b: a < b, "above": lambda a, b: a > b,
}  # fmt: skip

COMPARISONS = (
    "about", *BOUNDS, "is_", "rising", "falling", "same", "largest", "smallest", "holds",
)  # fmt: skip

BOUND_WORDS = {
    r"at most|not (?:surpass|exceed|above)|below|less than|under \d|up to"
    r"|\b[Nn]o\b(?: \w+){0,4} (?:more than|exceeds|above)": ("at_most", "below"),
    r"at least|more than|exceeds|above": ("at_least", "above"),
}  # fmt: skip
"""Words that print a bound, and the comparisons of which a fact then has one; what the first found
is no longer looked at."""

Bound = float | list[float] | Literal["than"] | None


class FactError(CdprError, ValueError):
    """A fact is not accepted; the words name file, section, fact and field."""


class MissingRuns(Exception):
    """Rows that a fact or a table needs are not there."""


class _Data(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Selection(_Data):
    """A quantity of some rows.

    Attributes:
        of: Column, expression in columns, or several of them, whose values all count.
        where: Values that columns have: one, or a list.
        rows: Expression that is true of the rows.
        by: A key column and its values: each gives a number; `across` makes one of them.
        paired: Key columns by whose values rows of two selections are paired.
        over: What makes one number of several rows; "each": every row is one.
    """

    of: str | list[str] = ""
    where: dict[str, Any] = {}
    rows: str = ""
    by: dict[str, list[Any]] = {}
    paired: list[str] = []
    over: Literal["mean", "median", "max", "min", "sum", "rms", "drop", "each"] = "mean"
    across: Literal["", "mean", "max", "min"] = ""

    def values(self, table: Frame) -> dict[Any, float]:
        """Numbers by the value of `by` or `paired`, in SI units.

        Raises:
            MissingRuns: There are no such rows.
        """
        rows = self._rows(table)
        if self.paired:
            return {
                keys: self._number(some) for keys, some in rows.groupby(self.paired, sort=False)
            }
        if self.over == "each":
            return dict(enumerate(self._column(rows)))
        if not self.by:
            return {"": self._number(rows)}
        ((column, names),) = self.by.items()
        numbers = {name: self._number(_rows_with(rows, column, [name])) for name in names}
        return {"": float(OVER[self.across](list(numbers.values())))} if self.across else numbers

    def _rows(self, rows: Frame) -> Frame:
        for column, value in self.where.items():
            rows = _rows_with(rows, column, value if isinstance(value, list) else [value])
        return rows[rows.eval(self.rows).astype(bool)] if self.rows else rows

    def _number(self, rows: Frame) -> float:
        values = self._column(rows)
        if len(values):
            return float(OVER["mean" if self.over == "each" else self.over](values))
        if self.rows:
            return float("nan")  # rows exist, of which none is so: no comparison holds
        raise MissingRuns(f"{self.of} where {self.where}")

    def _column(self, rows: Frame) -> Any:
        names = [self.of] if isinstance(self.of, str) else self.of
        try:
            columns = [rows[name] if name in rows else rows.eval(name) for name in names]
        except (KeyError, pd.errors.UndefinedVariableError) as problem:
            raise MissingRuns(str(problem)) from None
        return np.concatenate([np.asarray(column, float) for column in columns])


class Part(Selection):
    """A comparison: a selection, and exactly one of the keys from `about` to `holds`.

    Values are numbers in `unit`: one, or one for each value of `by`; or "than", another selection.

    Attributes:
        moment: Which number of a curve in time is printed, if the column is one.
        unit: Of the print; empty: the column's.
        per: Another selection, by which the quantity is divided.
        minus: Another selection, which is subtracted.
        than: Another selection, with which the quantity is compared, times `times`, plus `plus`.
        about: A size, within `factor`, or within `tolerance` plus `share` of it.
        at_most: A bound, as `at_least`, `below`, `above`.
        is: A value that all rows have.
        rising: From each value of `by` to the next at least by this factor; `falling` likewise;
            with 1 and `strict` equal ones do not rise.
        same: The largest and the smallest differ by less, plus `share` of the largest.
        largest: The value of `by` at which the quantity is largest; `smallest` likewise.
        holds: Expression that is true of each row.
        take: What has to hold of several: "each" is a part of its own, else all, most, any.
    """

    moment: Literal["", "end", "largest", "mean", "first"] = ""
    unit: str = ""
    per: Selection | None = None
    minus: Selection | None = None
    than: Selection | None = None
    times: float = 1.0
    plus: float = 0.0
    about: float | list[float] | None = None
    factor: float = 0.0
    share: float = 0.0
    tolerance: float = 0.0
    at_most: Bound = None
    at_least: Bound = None
    below: Bound = None
    above: Bound = None
    is_: Any = Field(None, alias="is")
    rising: float | list[float] | None = None
    falling: float | list[float] | None = None
    strict: bool = True
    same: float | None = None
    largest: Any = None
    smallest: Any = None
    holds: str = ""
    take: Literal["each", "all", "most", "any"] = "each"

    @property
    def comparison(self) -> str:
        """Which comparison it is."""
        return next(name for name in COMPARISONS if getattr(self, name) not in (None, ""))

    @model_validator(mode="after")
    def _one_comparison(self) -> Part:
        names = [name for name in COMPARISONS if getattr(self, name) not in (None, "")]
        if self.unit and self.unit not in UNITS_OF_PRINTS:
            raise ValueError(f"unit: found {self.unit}; accepted: {', '.join(UNITS_OF_PRINTS)}")
        if len(names) != 1:
            found = ", ".join(names) or "no comparison"
            raise ValueError(f"found {found}; accepted: one of {', '.join(COMPARISONS)}")
        if self.about is not None and not (self.factor or self.share or self.tolerance):
            raise ValueError("about: accepted with factor, share or tolerance")
        if (self.than is not None) != (getattr(self, names[0]) == "than"):
            raise ValueError("than: accepted with at_most, at_least, below or above: than")
        return self

    def judge(self, rows: Frame) -> tuple[list[bool], str]:
        """Of each number whether it holds, and words.

        Raises:
            MissingRuns: Rows lack.
        """
        if self.holds:
            some = Selection(where=self.where, rows=self.rows, of=self.holds, over="each")
            held = [value > 0.0 for value in some.values(rows).values()]
            return self._taken(held), f"{sum(held)} of {len(held)}"
        if self.is_ is not None:
            is_so = f"`{self.of}` == {self.is_!r}"
            some = Selection(where=self.where, rows=self.rows, by=self.by, of=is_so)
            shares = some.values(rows)
            words = ", ".join(f"{name} {100.0 * share:.3g} %" for name, share in shares.items())
            return self._taken([share == 1.0 for share in shares.values()]), f"{self.is_}: {words}"
        scale = FACTORS.get(self.unit, 1.0)
        numbers = {name: scale * value for name, value in self.values(rows).items()}
        for other, change in ((self.per, np.divide), (self.minus, np.subtract)):
            if other is not None:
                more = {k: scale * v for k, v in self._like(other).values(rows).items()}
                numbers = {k: float(change(a, b)) for k, (a, b) in _pairs(numbers, more).items()}
        words = _listed(numbers, self._unit())
        if self.than is None:
            return self._taken(self._compared(numbers)), words
        others = {k: scale * v for k, v in self._like(self.than).values(rows).items()}
        moved = {k: value * self.times + self.plus for k, value in others.items()}
        pairs = _pairs(numbers, moved)
        held = [BOUNDS[self.comparison](a, b) for a, b in pairs.values()]
        if len(pairs) > 4:
            return self._taken(held), f"so in {sum(held)} of {len(held)}"
        return self._taken(held), f"{words} beside {_listed(others, self._unit())}"

    def _like(self, other: Selection) -> Selection:
        """Another selection, which is as this one where it says nothing."""
        own_by = {} if other.across else self.by
        return other.model_copy(update={
            "of": other.of or self.of,
            "where": {**self.where, **other.where},
            "rows": other.rows or self.rows,
            "by": other.by or own_by,
            "paired": other.paired or ([] if other.by else self.paired),
            "over": other.over if other.over != "mean" else self.over,
        })  # fmt: skip

    def _compared(self, numbers: Mapping[Any, float]) -> list[bool]:
        kind, values = self.comparison, list(numbers.values())
        print_ = getattr(self, kind)
        if kind in ("rising", "falling"):
            steps = [(a, b) if kind == "rising" else (b, a) for a, b in pairwise(values)]
            factors = print_ if isinstance(print_, list) else [print_] * len(steps)
            return [
                b > a if factor == 1.0 and self.strict else b >= factor * a
                for (a, b), factor in zip(steps, factors, strict=True)
            ]
        if kind == "same":
            return [max(values) - min(values) < print_ + self.share * max(values)]
        if kind in ("largest", "smallest"):
            extreme = (np.argmax if kind == "largest" else np.argmin)(values)
            return [list(numbers)[int(extreme)] == print_]
        sizes = print_ if isinstance(print_, list) else [print_] * len(values)
        holds = self._near if kind == "about" else BOUNDS[kind]
        return [holds(value, size) for value, size in zip(values, sizes, strict=True)]

    def _near(self, value: float, size: float) -> bool:
        if self.factor:
            return size / self.factor <= value <= size * self.factor
        return abs(value - size) <= self.tolerance + self.share * abs(size)

    def _taken(self, held: Sequence[bool]) -> list[bool]:
        if not held:
            raise MissingRuns(f"{self.of or self.holds} where {self.where}")
        share = float(np.mean(held))
        match self.take:
            case "all":
                return [share == 1.0]
            case "most":
                return [share > 0.5]
            case "any":
                return [share > 0.0]
        return [bool(one) for one in held]

    def print_words(self) -> str:
        """What is printed, as it is judged: a bound as a bound."""
        size = getattr(self, self.comparison)
        if size == "than" or self.comparison in ("holds", "same", "largest", "smallest"):
            return ""
        sizes = size if isinstance(size, list) else [size]
        values = ", ".join(f"{x:g}" if isinstance(x, float) else str(x) for x in sizes)
        if self.comparison in ("rising", "falling"):
            return self.comparison if sizes == [1.0] else f"{self.comparison} by a factor {values}"
        words = f"{self.comparison.rstrip('_').replace('_', ' ')} {values} {self._unit()}".strip()
        return words + (f" (within {self._nearness()})" if self.comparison == "about" else "")

    def _nearness(self) -> str:
        if self.factor:
            return f"a factor {self.factor:g}"
        return f"{100 * self.share:g} %" if self.share else f"{self.tolerance:g}"

    def _unit(self) -> str:
        if self.per is not None:
            return ""
        column = self.of if isinstance(self.of, str) else self.of[0]
        ends = (name.rpartition("_")[2] for name in reversed(column.split(".")) if "_" in name)
        return self.unit or next((UNIT_WORDS[end] for end in ends if end in UNIT_WORDS), "")


class Entry(_Data):
    """What a source prints that is no fact: a figure or table that is shown, cited, or missing.

    Attributes:
        at: All places where it is printed.
        says: What it shows; of a fact, the sentence as near to the source's words as can be.
        figures: "study/figure" that shows it.
        differs: How these differ from the published one.
        cited: Why there is nothing to compare.
        missing: Why nothing here shows it.
    """

    at: list[str] = []
    says: str
    figures: list[str] = []
    differs: str = ""
    cited: str = ""
    missing: str = ""

    def studies(self) -> set[str]:
        """Studies that answer it."""
        return {name.partition("/")[0] for name in self.figures}


class Fact(Entry):
    """A sentence or number of a source.

    Attributes:
        name: Once in its study.
        study: What answers it.
        basis: What a verdict rests on.
        reason: Why the basis is "fitted" or "by construction".
        parts: Comparisons.
        find: Name of a function of the study, if the fact is no comparison.
        in_part: When it holds in part: if any or most of its parts hold, or if these do.
        cause: Why it does not hold: "source", "hardware" or "ours", each with its reason; empty:
            nobody knows.
        rule: More words on what is compared.
        note: What is known besides.
    """

    name: str
    study: str
    basis: Basis
    reason: str = ""
    parts: list[Part] = []
    find: str = ""
    in_part: list[Part] | Literal["any", "most"] = "any"
    cause: dict[Literal["source", "hardware", "ours"], str] = {}
    rule: str = ""
    note: str = ""

    def studies(self) -> set[str]:
        """The study that answers it."""
        return {self.study}

    @model_validator(mode="after")
    def _reasons_are_told(self) -> Fact:
        if self.basis in ("fitted", "by construction") and len(self.reason.split()) < 3:
            raise ValueError(f"{self.name}: basis {self.basis}; accepted with its reason")
        if any(len(reason.split()) < 3 for reason in self.cause.values()):
            raise ValueError(f"{self.name}: cause; accepted with its reason")
        if bool(self.parts) == bool(self.find):
            raise ValueError(f"{self.name}: accepted: parts, or find")
        return self

    @model_validator(mode="after")
    def _bounds_are_bounds(self) -> Fact:
        kinds, says = {part.comparison for part in self.parts}, self.says
        for words, accepted in BOUND_WORDS.items():
            says, bounds = re.subn(words, "", says)
            if kinds and bounds and not kinds & set(accepted):
                raise ValueError(
                    f"{self.name}: {self.says!r} prints a bound; found {', '.join(kinds)}; "
                    f"accepted: {' or '.join(accepted)}"
                )
        return self

    def judge(
        self, rows: Frame | None, finds: Mapping[str, Find], moments: Mapping[str, str],
        unjudged: str,
    ) -> dict[str, Any]:  # fmt: skip
        """The fact with its verdict, for JSON.

        Args:
            rows: Rows of its study; None: it is not judged.
            finds: Functions of its study.
            moments: Of its columns, see `Study.moments`.
            unjudged: The verdict if it is not judged, or if rows lack.

        Raises:
            ValueError: A part is about another number of a curve than its column.
        """
        for part in self.parts:
            _check_moment(part, moments)
        held, words = list[bool](), list[str]()
        try:
            if rows is None:
                raise MissingRuns
            if self.find:
                parts, found = finds[self.find](rows)
                held, words = [bool(one) for one in parts], [found]
            for part in self.parts:
                more, found = part.judge(rows)
                held, words = [*held, *more], [*words, found]
            verdict = self._verdict(held, rows)
        except MissingRuns as lacking:
            held, verdict = [], unjudged or "not judged"
            if str(lacking):
                words = [f"runs are missing: {lacking}"]
        except Exception as problem:  # rows must not be lost
            held, verdict, words = [], "not judged", [f"judging failed: {problem}"]
        cause = "; ".join(f"{kind}: {reason}" for kind, reason in self.cause.items()) or "not known"
        return {
            "name": self.name, "words": self.says, "source": ", ".join(self.at),
            "basis": self.basis, "reason": self.reason,
            "printed": "; ".join(filter(None, (part.print_words() for part in self.parts))),
            "found": "; ".join(words), "verdict": verdict, "held": sum(held), "of": len(held),
            "cause": cause if verdict in ("in part", "not confirmed") else "", "why": self.note,
            "rule": self.rule,
        }  # fmt: skip

    def _verdict(self, held: Sequence[bool], rows: Frame) -> str:
        if not held:
            raise MissingRuns  # the words say what rows there are
        if all(held):
            return GOOD[self.basis]
        some = any(held)
        if self.in_part == "most":
            some = 2 * sum(held) > len(held)
        elif self.in_part != "any" and not some:
            some = all(all(part.judge(rows)[0]) for part in self.in_part)
        return "in part" if some else "not confirmed"


def _check_moment(part: Part, moments: Mapping[str, str]) -> None:
    for column in [part.of] if isinstance(part.of, str) else part.of:
        if moments.get(column, "") != part.moment:
            have, print_ = moments.get(column) or "only", part.moment or "only"
            raise ValueError(f"{column}: is the {have} value of a run, the print's is the {print_}")


class Source(_Data):
    """A thesis, or what we ask for ourselves: sections with their facts and entries, in order."""

    title: str
    sections: dict[str, list[Fact | Entry]]

    def facts(self) -> list[Fact]:
        """Its facts."""
        return [one for some in self.sections.values() for one in some if isinstance(one, Fact)]


def source_of(words: Mapping[str, Any]) -> Source:
    """A source from a file's content.

    The name of a section is its number, and perhaps a colon and its title. An entry without `at` is
    printed there.

    Raises:
        FactError: An entry is not accepted.
    """
    sections: dict[str, list[Fact | Entry]] = {}
    for name, entries in words["sections"].items():
        sections[str(name)] = []
        for entry in entries:
            at = [str(name).partition(":")[0]]
            sections[str(name)].append(_entry_of({"at": at, **entry}, str(name)))
    return Source(title=words["title"], sections=sections)


def _entry_of(words: Mapping[str, Any], where: str) -> Fact | Entry:
    try:
        return (Fact if "study" in words else Entry)(**words)
    except ValidationError as problem:
        first = problem.errors()[0]
        field = ".".join(map(str, first["loc"]))
        who = words.get("name", words.get("says"))
        raise FactError(f"{where}: {who}: {field}: {first['msg']}") from problem


def check_facts(facts: Iterable[Fact]) -> None:
    """Refuses facts that stand twice, by name or by what they compare; raises FactError."""
    owners: dict[str, str] = {}
    for fact in facts:
        name = f"{fact.study}/{fact.name}"
        for key in (name, *(f"{fact.study} {part!r}" for part in fact.parts)):
            if key in owners:
                raise FactError(f"{name}: the same as {owners[key]}")
        owners |= {name: name, **{f"{fact.study} {part!r}": name for part in fact.parts}}


@cache
def sources() -> tuple[Source, ...]:
    """All sources of this package.

    Raises:
        FactError: An entry is not accepted, or a fact stands twice.
    """
    found = []
    for path in sorted(FOLDER.glob("*.yaml")):
        try:
            found.append(source_of(load_yaml(path.read_text(encoding="utf-8"))))
        except (FactError, YamlTextError) as problem:
            raise FactError(f"{path.name}: {problem}") from problem
    check_facts(fact for source in found for fact in source.facts())
    return tuple(found)


def facts_of(study: str, own: Sequence[Mapping[str, Any]] = ()) -> list[Fact]:
    """Facts that a study answers; its own ones are those of a study outside of this package."""
    if own:
        entries = (_entry_of({"study": study, **words}, study) for words in own)
        return [entry for entry in entries if isinstance(entry, Fact)]
    return [fact for source in sources() for fact in source.facts() if fact.study == study]


def judged(
    facts: Sequence[Fact], rows: Frame | None, finds: Mapping[str, Find],
    moments: Mapping[str, str], unjudged: str,
) -> list[dict[str, Any]]:  # fmt: skip
    """Facts with verdicts, see `Fact.judge`."""
    return [fact.judge(rows, finds, moments, unjudged) for fact in facts]


def scorecard(statements: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, int]]:
    """How many facts of sources have which verdict, and how many of ours."""
    ours = [one["verdict"] for one in statements if one["basis"] == "ours"]
    printed = [one["verdict"] for one in statements if one["basis"] != "ours"]
    return {"verdicts": dict(Counter(printed)), "ours": dict(Counter(ours))}


def _rows_with(rows: Frame, column: str, values: list[Any]) -> Frame:
    """Rows with one of these values of a column; MissingRuns if one of them has no row."""
    if column not in rows:
        raise MissingRuns(column)
    for value in values:
        if not (rows[column] == value).any():
            raise MissingRuns(f"{column} {value}")
    return rows[rows[column].isin(values)]


def _pairs(
    first: Mapping[Any, float], second: Mapping[Any, float]
) -> dict[Any, tuple[float, float]]:
    """Numbers of two selections beside each other: by equal names, else in order."""
    if shared := [name for name in first if name in second]:
        return {name: (first[name], second[name]) for name in shared}
    others = list(second.values()) * (len(first) if len(second) == 1 else 1)
    return {name: (a, b) for (name, a), b in zip(first.items(), others, strict=True)}


def _listed(numbers: Mapping[Any, float], unit: str) -> str:
    words = (f"{name} {value:.4g}".strip() for name, value in numbers.items())
    return f"{', '.join(words)} {unit}".strip()
