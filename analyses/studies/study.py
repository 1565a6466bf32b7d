"""The frame of studies: cases, the call that measures each, and what is made of the rows.

A case is a call of a module's function, and keys that tell its row from others. A call gives
numbers, words, lists, tables of names and arrays; names of columns end with their SI unit. Equal
calls are made once, whichever cases ask for them. Rows are kept as they come, so the same command
goes on after a kill, on any processes, to the same bytes. Nothing but call and seed may change a
row; what measures times is measured last, alone.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeAlias

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import figure_writers
from cdpr_drake.analyses.frame.folder import Folder, read_marker
from cdpr_drake.analyses.frame.follow import NOBODY, Count, Follow
from cdpr_drake.analyses.frame.jobs import finished_jobs
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import DEFAULT_FORMATS
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
from cdpr_drake.analyses.studies.facts import (
    FACTORS,
    Find,
    MissingRuns,
    facts_of,
    judged,
    scorecard,
)
from cdpr_drake.analyses.studies.rows import Call, Plan, Row, RowStore, check_earlier, digest
from cdpr_drake.analyses.workspaces.pose_grid import plain
from cdpr_drake.errors import CdprError
from cdpr_drake.schema.typed_yaml import closest
from cdpr_drake.summaries import Summarized

Frame: TypeAlias = pd.DataFrame
RESULTS = "results.json"
"""File of a study's folder: what came out, but arrays."""

MOST_SEEDS = 10_000
"""Every row of a study is listed before the first is measured."""

OTHER_CODE = "name another folder, and this one by runs_from, which takes over equal calls,"
"""What one does with a folder of the same study and form by other code."""

UNITS = {
    "m": "m", "m2": "m^2", "m3": "m^3", "rad": "rad", "deg": "deg", "px": "px", "s": "s", "n": "N",
    "n_m": "N m", "n2": "N^2", "m_s": "m/s", "rad_s": "rad/s", "m_s2": "m/s^2", "kg": "kg",
    "hz": "Hz", "us": "us", "percent": "%", "j": "J", "w": "W",
}  # fmt: skip
"""Units by the last words of the names of columns."""


@dataclass(frozen=True)
class Form:
    """In which form a study is run.

    Attributes:
        quick: True for a short form, which shows that everything works.
        seeds: How often what depends on chance is measured; None: as often as the study says.
        recipe: One of the study's other recipes; empty: its own.
    """

    quick: bool = False
    seeds: int | None = None
    recipe: str = ""

    def times(self, full: int, quick: int = 1, most: int | None = None) -> int:
        """How often a case that depends on chance is measured."""
        count = self.seeds or (quick if self.quick else full)
        return count if most is None else min(count, most)


@dataclass(frozen=True, kw_only=True)
class Case:
    """A row, or one for each seed.

    Attributes:
        keys: The row's first columns.
        call: Gives the other columns; a partial of a module's function with plain arguments.
        seeds: How often it is called, with seed=0, 1, ...; 0: once, without a seed.
        alone: True if it measures times.
    """

    keys: Mapping[str, Any]
    call: Call
    seeds: int = 0
    alone: bool = False

    def calls(self) -> Iterator[tuple[dict[str, Any], Call]]:
        """Keys and call of each of its rows."""
        if not self.seeds:
            yield dict(self.keys), self.call
        for seed in range(self.seeds):
            yield {**self.keys, "seed": seed}, partial(self.call, seed=seed)


@dataclass(frozen=True, kw_only=True)
class Study:
    """A study. Its facts are data: entries of `facts/*.yaml` under its name, or `facts`.

    Attributes:
        name: Its name for `cdpr study`.
        title: What it shows, in one line.
        cases: Gives all cases of a form.
        source: Where what it repeats is printed.
        tables: What makes tables of the rows, by title.
        figures: What draws the rows, by the name of the file.
        finds: What judges facts that are no comparison, by name.
        moments: Which number of a curve in time a column is: "end", "largest", "mean" or "first".
        compared: Gives the rows that facts are about; all, if it says nothing.
        numbers: Gives more numbers for JSON.
        parameters: Gives what all cases have in common, for JSON.
        assumptions: What the source leaves open, and what was chosen.
        facts: Facts of a study that is not of this package, as an entry of `facts/*.yaml` each.
        coarse: True if the quick form has coarser grids or shorter runs, so that it judges nothing.
        recipes: Names of other recipes, see `Form.recipe`.
    """

    name: str
    title: str
    cases: Callable[[Form], Iterable[Case]]
    source: str = ""
    tables: Mapping[str, Callable[[Frame], Frame]] = field(default_factory=dict)
    figures: Mapping[str, Callable[[Frame], Figure]] = field(default_factory=dict)
    finds: Mapping[str, Find] = field(default_factory=dict)
    moments: Mapping[str, str] = field(default_factory=dict)
    compared: Callable[[Frame], Frame] = lambda rows: rows
    numbers: Callable[[Frame], Mapping[str, Any]] | None = None
    parameters: Callable[[Form], Mapping[str, Any]] = lambda form: {}
    assumptions: Sequence[str] = ()
    facts: Sequence[Mapping[str, Any]] = ()
    coarse: bool = False
    recipes: Sequence[str] = ()


@verb()
def run_study(
    study: str | Study, folder: Path | str | None = None, quick: bool = False, *,
    seeds: int | None = None, recipe: str = "", workers: int | str | None = None,
    overwrite: bool = False, formats: Sequence[str] = DEFAULT_FORMATS,
    runs_from: Path | str | None = None, follow: Follow = NOBODY,
) -> StudyResult:  # fmt: skip
    """Runs a study, or what of it is not yet in its folder.

    Args:
        study: Its name, or a study of your own.
        folder: Results folder, where the same call goes on; None: nothing is kept.
        quick: The short form, to see that everything works.
        seeds: How often what depends on chance is measured.
        recipe: Another recipe, for studies that have some.
        workers: Processes, a Dask scheduler, or None: one for each processor, for long work.
        overwrite: True to replace results of other code or another form.
        formats: Endings of the figures' files.
        runs_from: Folder of the same study by other code, whose rows of equal calls are taken over.
        follow: Who follows.

    Raises:
        CdprError: Study or recipe is unknown, `runs_from` is no folder of it, or the folder holds
            other results or files, cannot be written, or another command writes there.
        SweepError: The cluster cannot be used.
    """
    one = study_named(study) if isinstance(study, str) else study
    if recipe and recipe not in one.recipes:
        accepted = closest(recipe, one.recipes) if one.recipes else "accepted: none, as it has none"
        raise CdprError(f"recipe: {recipe!r} is unknown for {one.name}; {accepted}")
    if seeds is not None and not 1 <= seeds <= MOST_SEEDS:
        raise CdprError(f"seeds: found {seeds}; accepted: 1 to {MOST_SEEDS}")
    for fact in facts_of(one.name, one.facts):
        if fact.find and fact.find not in one.finds:
            raise CdprError(f"{fact.name}: find: {fact.find!r}; {closest(fact.find, one.finds)}")
    form = Form(quick, seeds, recipe)
    arguments = arguments_of(one.name, form)
    if runs_from is not None:
        check_earlier(Path(runs_from), arguments)
    with ExitStack() as stack:
        if folder is None:
            where = Path(stack.enter_context(TemporaryDirectory(prefix="cdpr-study-")), one.name)
        else:
            where = Path(folder)
        present = (read_marker(where) or {}).get("arguments")
        earlier = isinstance(present, dict) and {**present, "code": ""} == {**arguments, "code": ""}
        elsewhere = OTHER_CODE if earlier else "name another folder"
        results = stack.enter_context(
            Folder(where, arguments, overwrite, grows=True, elsewhere=elsewhere)
        )
        rows = stack.enter_context(RowStore(results))
        if runs_from is not None:
            rows.take_over(Path(runs_from))
        plan = [
            (keys, call, digest(call), case.alone)
            for case in one.cases(form) for keys, call in case.calls()
        ]  # fmt: skip
        failed = _measure(plan, rows, workers, follow, one.name)
        records = rows.in_order(plan, in_memory=folder is None)
        lacking = {digest for _, _, digest, _ in plan if digest not in rows}
        found = StudyResult(
            one, form, records, len(plan), rows.taken, failed,
            folder=None if folder is None else results.path, stopped=len(lacking) > len(failed),
        )  # fmt: skip
        if folder is not None:
            found.undrawn.update(found.write(results, formats, follow.stop))
            if not found.interrupted and not found.undrawn:
                results.complete()
            elif found.undrawn and follow.stop():
                found = replace(found, stopped=True)
    return found


def arguments_of(study: str, form: Form) -> dict[str, Any]:
    """What the rows in a folder of a study depend on, beside their calls."""
    return {
        "study": study, "quick": form.quick, "recipe": form.recipe, "code": code_version(),
    }  # fmt: skip


def _measure(
    plan: Plan, rows: RowStore, workers: int | str | None, follow: Follow, name: str
) -> dict[str, str]:
    """Measures what lacks, and gives what failed: words by digest."""
    lacking = {digest: (keys, call, alone) for keys, call, digest, alone in plan}
    total = len(lacking)
    lacking = {digest: one for digest, one in lacking.items() if digest not in rows}
    count, failed = Count(follow, total, total - len(lacking)), dict[str, str]()
    for alone in (False, True):
        names = [digest for digest, one in lacking.items() if one[2] == alone]
        calls = [lacking[digest][1] for digest in names]
        for finished in finished_jobs(
            measured, calls, 1 if alone else workers, stop=follow.stop, say=follow.say, name=name
        ):
            digest, keys = names[finished.number], lacking[names[finished.number]][0]
            words = ", ".join(f"{key} {value}" for key, value in keys.items())
            if finished.problem is None:
                rows.add(digest, finished.result or {})
            else:
                failed[digest] = f"{words}: {finished.words()}"
                follow.say(failed[digest])
            count.add(1, words)
    return failed


def measured(call: Call) -> Row:
    """A row."""
    return call()


@dataclass(frozen=True, eq=False, repr=False)
class StudyResult(Summarized):
    """What a study found.

    Attributes:
        study: The study.
        form: In which form it was run.
        records: Its rows, keys first, `arrays` last.
        planned: How many rows there are when it is complete.
        taken: How many of them other code had measured.
        failed: Words by digest of calls that raised, or whose process died.
        undrawn: Of files that were not written, the name and why.
        folder: The results folder; None if nothing was kept.
        stopped: True if it was stopped before all was measured and drawn.
    """

    study: Study
    form: Form
    records: Sequence[Mapping[str, Any]]
    planned: int
    taken: int = 0
    failed: Mapping[str, str] = field(default_factory=dict)
    undrawn: dict[str, str] = field(default_factory=dict)
    folder: Path | None = None
    stopped: bool = False

    @property
    def interrupted(self) -> bool:
        """True if rows lack."""
        return len(self.records) < self.planned

    @cached_property
    def rows(self) -> Frame:
        """The rows as a table; NaN if a row has no such column."""
        return Frame(self.records)

    @cached_property
    def statements(self) -> list[dict[str, Any]]:
        """Facts with verdicts; a recipe that is not the study's own says nothing of them."""
        study, unjudged = self.study, ""
        if self.interrupted:
            unjudged = "interrupted"
        elif self.form.quick:
            unjudged = "not judged in the quick form"
        blind = self.interrupted or (self.form.quick and study.coarse)
        rows = (
            None if blind or not self.records else with_names_of_tables(study.compared(self.rows))
        )
        facts = [] if self.form.recipe else facts_of(study.name, study.facts)
        return judged(facts, rows, study.finds, study.moments, unjudged)

    def tables(self) -> dict[str, Frame]:
        """Tables by title, that of the facts last; those whose rows lack are left out."""
        found, form = {}, self.form
        for title, make in self.study.tables.items():
            try:
                found[title] = make(self.rows)
            except Exception as problem:  # numbers must not be lost
                lacks = isinstance(problem, (MissingRuns, KeyError))
                if not (lacks and (self.interrupted or form.quick or form.recipe)):
                    self.undrawn[f"table {title!r}"] = f"{type(problem).__name__}: {problem}"
        if self.statements:
            columns = ["words", "printed", "found", "verdict", "rule", "why"]
            found["What has to hold"] = Frame(self.statements, columns=columns)
        return found

    def drawings(self) -> dict[str, Callable[[], Figure]]:
        """What draws its figures, by name."""
        if not self.records:
            return {}
        return {name: partial(self._drawn, draw) for name, draw in self.study.figures.items()}

    def _drawn(self, draw: Callable[[Frame], Figure]) -> Figure:
        """A figure that says if it shows less than the study's full form."""
        figure = draw(self.rows)
        marks = ["quick form"] * self.form.quick
        marks += [f"{len(self.records)} of {self.planned} rows"] * self.interrupted
        figure.text(0.998, 0.002, ", ".join(marks), ha="right", va="bottom", fontsize="small")
        return figure

    def plot(self, name: str | None = None) -> Figure:
        """A figure of the study.

        Args:
            name: One of `drawings`; None: the first.

        Raises:
            CdprError: There is no such figure, or none at all.
        """
        drawings = self.drawings()
        if not drawings:
            raise CdprError(f"study {self.study.name}: nothing to draw; see its tables")
        if name is not None and name not in drawings:
            raise CdprError(f"name: {name!r} is unknown; {closest(name, drawings)}")
        return drawings[name or next(iter(drawings))]()

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself: verdicts, rows, tables, figures."""
        count = Counter(fact["verdict"] for fact in self.statements)
        verdicts = ", ".join(f"{number} {verdict}" for verdict, number in count.items())
        return f"Study {self.study.name}" + ", interrupted" * self.interrupted, [
            ("facts", verdicts or "none judged"),
            ("rows", f"{len(self.records)} of {self.planned}"),
            ("tables", ", ".join(self.tables()) or "none"),
            ("figures", ", ".join(self.drawings()) or "none"),
            ("folder", "none" if self.folder is None else str(self.folder)),
        ]

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON but arrays; what is not finite is null."""
        study, columns = self.study, [name for name in self.rows if name != "arrays"]
        numbers = {} if study.numbers is None or self.interrupted else study.numbers(self.rows)
        told = {
            "study": study.name, "title": study.title, "source": study.source,
            "quick": self.form.quick, "interrupted": self.interrupted,
            "rows": {"done": len(self.records), "of": self.planned},
            "by_earlier_code": self.taken, "failed": list(self.failed.values()),
            "versions": package_versions(), "parameters": study.parameters(self.form),
            "assumptions": list(study.assumptions),
            "units": {name: unit for name in columns if (unit := unit_of(name))},
            "runs": [{k: v for k, v in row.items() if k != "arrays"} for row in self.records],
            "numbers": numbers, "statements": self.statements,
            "scorecard": scorecard(self.statements), "figures": list(study.figures),
        }  # fmt: skip
        result: dict[str, Any] = finite(plain(told))
        return result

    def write(
        self, folder: Folder, formats: Sequence[str], stop: Callable[[], bool]
    ) -> dict[str, str]:
        """Writes rows, results, tables and figures; gives the files that failed, and why."""
        rows = self.rows.drop(columns="arrays", errors="ignore")
        folder.write_text("runs.csv", rows.to_csv(index=False))
        folder.write_json(RESULTS, self.as_dict())
        pages = (
            f"<h3>{title}</h3>\n{table.to_html(index=False, float_format='{:.4g}'.format)}"
            for title, table in self.tables().items()
        )
        folder.write_text("tables.html", "\n".join(pages))
        return folder.write_all(figure_writers(self.drawings(), formats), stop)


def with_names_of_tables(rows: Frame) -> Frame:
    """With a column "column.name" for each name of tables of names, at any depth."""
    more: dict[str, Any] = {}
    for column in rows:
        tables = [value for value in rows[column] if isinstance(value, dict)]
        for name in dict.fromkeys(name for value in tables for name in value):
            more[f"{column}.{name}"] = [
                value.get(name, np.nan) if isinstance(value, dict) else np.nan
                for value in rows[column]
            ]
    if not more:
        return rows
    return pd.concat([rows, with_names_of_tables(Frame(more, rows.index))], axis=1)


def select(rows: Frame, **where: Any) -> Frame:
    """Rows with these values of columns.

    Raises:
        MissingRuns: There are none.
    """
    for column, value in where.items():
        if column not in rows or not len(rows := rows[rows[column] == value]):
            raise MissingRuns(f"{column} {value}")
    return rows


def summary(
    rows: Frame, by: str | list[str], cells: Mapping[str, tuple[str, str | Callable[..., Any]]]
) -> Frame:
    """A table with a row for each value of some columns.

    Args:
        rows: The rows.
        by: Columns by whose values rows of the table are made.
        cells: By heading a column, and what makes one number of it, as pandas knows it. A heading
            may end with another unit than the column's in square brackets.
    """
    table = rows.groupby(by, sort=False).agg(**cells)
    for heading, (column, _) in cells.items():
        unit = heading.rpartition("[")[2].rstrip("]")
        if unit in FACTORS and unit != unit_of(column):
            table[heading] *= FACTORS[unit]
    return table.reset_index()


def unit_of(column: str) -> str:
    """Unit of a column, from the end of its name; empty without one."""
    words = column.split("_")
    endings = ("_".join(words[-count:]) for count in (2, 1) if len(words) > count)
    return next((UNITS[ending] for ending in endings if ending in UNITS), "")


STUDIES = {
    "tension-methods": "tension_methods", "engines": "engines", "case-1": "case_1",
    "case-2": "acrobot_cases", "case-3": "acrobot_cases", "case-4": "caroca_cases",
    "case-5": "caroca_cases", "case-6": "ibvs_cases", "case-a6": "ibvs_cases",
    "case-7": "tracking_cases", "case-8": "tracking_cases", "case-9": "case_9",
    "case-10": "case_10", "mobile-robot": "mobile_robot",
    "control-stability": "control_stability",
    "stability-ranges": "stability_ranges", "stability-shapes": "stability_shapes",
    "stability-closed-loop": "closed_loops",
    "schemes": "schemes", "fusion": "fusion",
    "seen-slack": "seen_slack", "failure": "failures", "detection": "failures",
    "calibration": "calibration", "identification": "identification",
    "workspaces": "workspaces",
    "case-9-torque": "proposed_cases", "tension-tracking": "proposed_cases",
    "worked-examples": "worked_examples",
}  # fmt: skip
"""Modules of this folder by the names of studies; each has `STUDY`, or `STUDIES` by name."""


def studies() -> tuple[str, ...]:
    """Names of the studies of this package, as `run_study` takes them."""
    return tuple(STUDIES)


def study_named(name: str) -> Study:
    """A study of this package.

    Raises:
        CdprError: There is none of this name.
    """
    if name not in STUDIES:
        raise CdprError(f"study {name!r} is unknown; {closest(name, STUDIES)}")
    module = import_module(f"cdpr_drake.analyses.studies.{STUDIES[name]}")
    found: Study = module.STUDIES[name] if hasattr(module, "STUDIES") else module.STUDY
    return found
