"""The frame of every study: cases, what is measured of each, what is told and drawn of it.

A `Study` names its cases, a function that measures one with one seed, and what looks at the rows
that come of it: statements, tables, figures. Calling it runs it: it continues where it was
stopped, on any number of local processes or a cluster, with the same bytes, and returns a
`StudyResult`.

Nothing but the case and the seed may change a row. No time that a computer took is in a row, but
in cases that measure times, which are done last, alone.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.reporting.deferred_figures import NothingToDraw
from cdpr_drake.analyses.reporting.log_files import finite, write_json
from cdpr_drake.analyses.reporting.progress import (
    DEFAULT_STUDY_SESSION,
    StudySession,
    WorkProgress,
)
from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.framework.runs import (
    Keys,
    MissingRuns,
    Row,
    Run,
    Runs,
    pack_row,
    unpack_row,
)
from cdpr_drake.analyses.studies.framework.statement import (
    Check,
    Judged,
    judged,
    judged_table,
    scorecard,
)
from cdpr_drake.analyses.studies.framework.summary import COARSE, FULL
from cdpr_drake.analyses.sweeps.earlier_runs import EarlierRuns
from cdpr_drake.analyses.sweeps.folder import check_sweep_folder
from cdpr_drake.analyses.sweeps.sweep import run_study_sweep
from cdpr_drake.analyses.sweeps.workers import SweepTask
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS, write_figures
from cdpr_drake.analyses.workspaces.pose_grid import plain
from cdpr_drake.models.rendered_camera import probe_rendering

Arrays = Mapping[str, np.ndarray]

RUNS, ITEMS = "runs", "items"
"""What a study does where it says nothing else, and how many are done of them in its results, which
have the rows under "runs"."""

TableMaker = Callable[[Runs], Table | Sequence[Table]]
FigureMaker = Callable[[Runs], Figure]


@dataclass(frozen=True)
class Form:
    """In which form a study is run.

    Attributes:
        quick: Whether only to see that everything works.
        asked_seeds: How often what depends on chance is repeated, where the user says so.
    """

    quick: bool = False
    asked_seeds: int | None = None

    @property
    def grid(self) -> str:
        """Value of the key column `grid`, where a study has coarse grids in its quick form."""
        return COARSE if self.quick else FULL


@dataclass(frozen=True, kw_only=True)
class Case:
    """What is measured.

    Attributes:
        name: Once in a study; good as a file name.
        keys: Values of the key columns.
        label: Words for it in figures and tables.
        changes: Items "key.subkey=value" that change a scenario.
        data: What else the measurement needs: plain data, or a partial of a module's function.
        seeds: How often it is measured in place of the study's number.
        most: How often at most, whatever is asked.
        rendered: Whether it needs a renderer.
        task: What computes it in parts in the place of `measure`; see `Study.reduce`. Where it
            has a method `arguments`, this tells what its numbers depend on, for JSON.
        items: Of the task.
        same_task: Name of the case before it whose task gives its arrays too.
        alone: Whether it measures times: last, in this process, with nothing beside it.
        printed: By column what the source prints, in its words.
        why: What is known of the difference from what is printed.
        cause: Of what kind that is, see `framework.statement`; empty: nobody knows.
    """

    name: str
    keys: Mapping[str, Any] = field(default_factory=dict)
    label: str = ""
    changes: tuple[str, ...] = ()
    data: Any = None
    seeds: int | None = None
    most: int | None = None
    rendered: bool = False
    task: SweepTask | None = None
    items: int = 1
    same_task: str = ""
    alone: bool = False
    printed: Mapping[str, str] = field(default_factory=dict)
    why: str = ""
    cause: str = ""

    def arguments(self) -> dict[str, Any]:
        """All that its rows depend on, for JSON."""
        told = {"keys": self.keys, "changes": self.changes, "data": _plain_call(self.data)}
        if self.task is not None:
            told |= {"task": _plain_call(self.task), "items": self.items}
        if self.same_task:
            told["same_task"] = self.same_task
        found: dict[str, Any] = finite(plain({name: one for name, one in told.items() if one}))
        return found


Measure = Callable[[Case, int], Row]


@dataclass(frozen=True)
class MeasureTask:
    """One measurement as a task of a sweep, of one item."""

    measure: Measure
    case: Case
    seed: int

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Its row, packed."""
        return pack_row(self.measure(self.case, self.seed))


@dataclass(frozen=True, kw_only=True)
class Study:
    """A study.

    Attributes:
        name: Its name for `cdpr study`.
        title: What it shows, in one line.
        source: Where what it repeats stands; may be empty.
        cases: Its cases in a form.
        measure: Gives the row of a case with a seed; a function of a module.
        reduce: Gives the row of a case that has a task, from its arrays.
        seeds: How often each case is measured, in the full form and in the quick one; None: once.
        checks: What sources say of it.
        stated: Title of the table of statements.
        tables: What puts runs into tables; MissingRuns where runs lack.
        figures: What draws runs, by the name of the file; likewise, or NothingToDraw where what
            there is to draw depends on what came out.
        assumptions: What the source leaves open, and what was chosen.
        parameters: What all cases have in common, for JSON, by form.
        numbers: More numbers for JSON, of the runs that are there.
        chunk: Items of a task that are computed at once.
        unit: Words for the items of all tasks.
        before: Said while cases are made, where that takes long; empty: nothing.
        recipes: The same by other recipes, by name, each a study of its own.
    """

    name: str
    title: str
    cases: Callable[[Form], Iterable[Case]]
    source: str = ""
    measure: Measure | None = None
    reduce: Callable[[Case, Arrays], Row] | None = None
    seeds: tuple[int, int] | None = None
    checks: Sequence[Check] = ()
    stated: str = "What has to hold"
    tables: Sequence[TableMaker] = ()
    figures: Mapping[str, FigureMaker] = field(default_factory=dict)
    assumptions: Sequence[str] = ()
    parameters: Callable[[Form], Mapping[str, Any]] | None = None
    numbers: Callable[[Runs], Mapping[str, Any]] | None = None
    chunk: int = 1
    unit: str = RUNS
    before: str = ""
    recipes: Mapping[str, Study] = field(default_factory=dict)

    def __call__(
        self, quick: bool = False, session: StudySession = DEFAULT_STUDY_SESSION
    ) -> StudyResult:
        """Runs it.

        Args:
            quick: The short form, to see that everything works.
            session: How it is run.

        Raises:
            OutputFolderError: The folder belongs to other arguments, which are named, holds other
                files, or cannot be written.
            RenderingError: A case needs a renderer, and there is none.
            SweepError: The scheduler does not answer or got lost, or a local process died.
        """
        form = Form(quick, session.seeds)
        if session.folder is not None:
            check_sweep_folder(session.folder)  # before its parameters are computed
        if self.before:
            session.tell(WorkProgress(self.before, 0, 1, 0.0, rate=f"{self.unit}/s"))
        cases = self.plan(form)
        tasks = self._tasks(cases, form)
        if any(case.rendered for case in cases):
            probe_rendering()
        result = run_study_sweep(
            tasks, self.chunk, self.unit, self._arguments(cases, form), session,
            alone=_names(tasks, (case.name for case in cases if case.alone)),
            case_of={name: case.name for case in cases for name in self._tasks([case], form)},
        )  # fmt: skip
        return StudyResult(
            self, form, tuple(cases), result.finished, result.progress, earlier=result.earlier
        )

    def plan(self, form: Form) -> list[Case]:
        """Its cases in a form.

        Raises:
            ValueError: Two have the same name, or one is no file name.
        """
        cases = list(self.cases(form))
        names = Counter(case.name for case in cases)
        bad = [name for name, count in names.items() if count > 1 or "/" in name or not name]
        if bad:
            raise ValueError(f"study {self.name}: cases {bad}; accepted: each once, without /")
        return cases

    def count(self, case: Case, form: Form) -> int | None:
        """How often a case is measured in a form; None: once, with no seed."""
        if self.seeds is None or case.task is not None or case.same_task:
            return None
        usual = self.seeds[1] if form.quick else case.seeds or self.seeds[0]
        return int(min(form.asked_seeds or usual, case.most or math.inf))

    def seeds_of(self, case: Case, form: Form) -> list[int | None]:
        """Seeds with which a case is measured; one None without."""
        count = self.count(case, form)
        return [None] if count is None else list(range(count))

    def planned(self, form: Form) -> Keys:
        """Values of the key columns in a form and in the full one."""
        found: dict[str, dict[Any, None]] = {}
        for one in {form, Form()}:
            for case in self.plan(one):
                for key, value in case.keys.items():
                    found.setdefault(key, {})[_hashable(value)] = None
        return {key: list(values) for key, values in found.items()}

    def _tasks(self, cases: Sequence[Case], form: Form) -> dict[str, tuple[SweepTask, int]]:
        tasks: dict[str, tuple[SweepTask, int]] = {}
        for case in cases:
            if case.task is not None:
                tasks[case.name] = (case.task, case.items)
            elif not case.same_task:
                assert self.measure is not None, f"study {self.name}: nothing measures {case.name}"
                for seed in self.seeds_of(case, form):
                    task = MeasureTask(self.measure, case, seed or 0)
                    tasks[_task_name(case, seed)] = (task, 1)
        return tasks

    def _arguments(self, cases: Sequence[Case], form: Form) -> dict[str, Any]:
        """All that the numbers depend on, for JSON."""
        return {
            "cdpr_drake": code_version(),
            "study": self.name,
            "quick": form.quick,
            "parameters": {} if self.parameters is None else finite(plain(self.parameters(form))),
            "cases": {
                case.name: {"runs": len(self.seeds_of(case, form)), **case.arguments()}
                for case in cases
            },
        }

    def names_of_checks(self) -> tuple[str, ...]:
        """Names of the statements that it judges."""
        return tuple(check.name for check in self.checks)


@dataclass(frozen=True, eq=False)
class StudyResult:
    """What a study found.

    Attributes:
        study: The study.
        form: In which form it was run.
        cases: What was to be measured.
        finished: Arrays of the tasks that are finished, by name.
        progress: Where it stood at the end, and what earlier sessions had left of it.
        earlier: Runs that were taken over from an earlier folder.
    """

    study: Study
    form: Form
    cases: tuple[Case, ...]
    finished: Mapping[str, Arrays]
    progress: WorkProgress
    earlier: EarlierRuns = field(default_factory=EarlierRuns, kw_only=True)

    @property
    def interrupted(self) -> bool:
        """Whether it was stopped before the end."""
        return self.progress.done < self.progress.total

    @property
    def quick(self) -> bool:
        """Whether it has the quick form."""
        return self.form.quick

    @cached_property
    def runs(self) -> Runs:
        """All rows that are there."""
        return self._runs(self.cases)

    @cached_property
    def whole(self) -> Runs:
        """Rows of the cases of which all are there: statements look at these."""
        done = len(self.runs)
        counts = {case.name: len(self.study.seeds_of(case, self.form)) for case in self.cases}
        if done == sum(counts.values()):
            return self.runs
        there = [run.case for run in self.runs]
        names = {name for name, count in counts.items() if there.count(name) == count}
        return self._runs([case for case in self.cases if case.name in names])

    def _runs(self, cases: Iterable[Case]) -> Runs:
        rows = []
        for case in cases:
            for seed in self.study.seeds_of(case, self.form):
                row = self._row(case, seed)
                if row is not None:
                    rows.append(Run(case.name, seed, case.keys, row, case.printed))
        return Runs(rows, lambda: self._planned)

    @cached_property
    def _planned(self) -> Keys:
        return self.study.planned(self.form)

    def _row(self, case: Case, seed: int | None) -> Row | None:
        if case.task is None and not case.same_task:
            arrays = self.finished.get(_task_name(case, seed))
            return None if arrays is None else unpack_row(arrays)
        arrays = self.finished.get(case.same_task or case.name)
        if arrays is None:
            return None
        assert self.study.reduce is not None, f"study {self.study.name}: nothing reduces {case}"
        return self.study.reduce(case, arrays)

    @cached_property
    def statements(self) -> list[Judged]:
        """What sources say, and whether it is so."""
        complete = not self.interrupted
        return judged(self.study.checks, self.whole, quick=self.quick, complete=complete)

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON but arrays, which are in `parts.npz`; what is not finite is null.

        No time that a computer took is in it but those that cases measured.
        """
        study, runs = self.study, self.runs
        told: dict[str, Any] = {
            "study": study.name,
            "title": study.title,
            "source": study.source,
            "quick": self.quick,
            "interrupted": self.interrupted,
            ITEMS if study.unit == RUNS else study.unit: self.progress.counts(),
            "versions": package_versions(),
            **({"by_earlier_code": counts} if (counts := self.earlier.counts()) else {}),
            "parameters": {} if study.parameters is None else plain(study.parameters(self.form)),
            "assumptions": list(study.assumptions),
            "cases": [self._case(case) for case in self.cases],
            "units": runs.units(),
            "arrays": runs.arrays(),
            "runs": runs.table(),
            "numbers": {} if isinstance(self._numbers, MissingRuns) else self._numbers,
            "statements": [one.as_dict() for one in self.statements],
            "scorecard": scorecard(self.statements),
            "left_out": self._left_out(),
        }
        cleaned: dict[str, Any] = finite(told)
        return cleaned

    def _case(self, case: Case) -> dict[str, Any]:
        told = {
            "name": case.name, "label": case.label, "keys": plain(case.keys),
            "changes": list(case.changes), "runs": len(self.study.seeds_of(case, self.form)),
            "printed": dict(case.printed), "why": case.why, "cause": case.cause,
        }  # fmt: skip
        return {key: value for key, value in told.items() if value not in ("", [], {})}

    @cached_property
    def _numbers(self) -> dict[str, Any] | MissingRuns:
        """More numbers, or what they lack."""
        if self.study.numbers is None:
            return {}
        try:
            return dict(plain(self.study.numbers(self.runs)))
        except MissingRuns as missing:
            return missing

    @property
    def _nothing_lacks(self) -> bool:
        """Whether it has all runs of the full form."""
        return not self.quick and not self.interrupted

    @cached_property
    def _made(self) -> list[tuple[str, Sequence[Table] | Exception]]:
        """Names of what makes tables, and what they made, or what they ended in."""
        found: list[tuple[str, Sequence[Table] | Exception]] = []
        for make in self.study.tables:
            try:
                made = make(self.runs)
                found.append((_name_of(make), [made] if isinstance(made, Table) else made))
            except Exception as problem:
                found.append((_name_of(make), problem))
        return found

    def tables(self) -> list[Table]:
        """Tables for the terminal, that of the statements last.

        One that lacks runs is left out; where all runs of the full form are there, a table of its
        name says what it lacks.
        """
        found: list[Table] = []
        for name, made in self._made:
            if not isinstance(made, Exception):
                found += made
            elif not isinstance(made, MissingRuns):
                raise made
            elif self._nothing_lacks:
                found.append(new_table(name, ("not made",), ()))
                found[-1].add_row(_lacking(made))
        if self.statements:
            found.append(judged_table(self.study.stated, self.statements))
        return found

    def drawings(self) -> dict[str, Callable[[], Figure]]:
        """What draws its figures, by name.

        Each raises NothingToDraw where runs lack; MissingRuns where all of the full form are there.
        """
        return {name: partial(self._draw, name, make) for name, make in self.study.figures.items()}

    def _draw(self, name: str, make: FigureMaker) -> Figure:
        if not len(self.runs):
            raise NothingToDraw
        try:
            return make(self.runs)
        except MissingRuns as missing:
            self._undrawn[name] = words = _lacking(missing)
            raise MissingRuns(words) if self._nothing_lacks else NothingToDraw from missing

    @cached_property
    def _undrawn(self) -> dict[str, str]:
        """What figures lack, by name, of those that were to be drawn until now."""
        return {}

    def _left_out(self) -> dict[str, dict[str, str]]:
        """Of figures, tables and numbers that were not made what they lack."""
        tables = {name: _lacking(made) for name, made in self._made if isinstance(made, Exception)}
        numbers = self._numbers
        lacks = {"numbers": _lacking(numbers)} if isinstance(numbers, MissingRuns) else {}
        return {"figures": dict(self._undrawn), "tables": tables, "numbers": lacks}

    def write(self, folder: Path, formats: Sequence[str] = DEFAULT_FORMATS) -> dict[str, str]:
        """Writes `runs.csv`, `results.json`, then the figures, into a folder that exists; then
        `results.json` again with the names of figures that lack runs, where some do.

        Returns:
            Of each figure that could not be written, the file and why, in one line.
        """
        self.runs.write_csv(folder / "runs.csv")
        told = self.as_dict()
        write_json(folder / "results.json", told)
        failed = write_figures(folder, self.drawings(), formats)
        if self._undrawn:
            write_json(folder / "results.json", told | {"left_out": self._left_out()})
        return failed


def _lacking(problem: Exception) -> str:
    """Why something was not made, in one line."""
    words = (str(problem) or type(problem).__name__).splitlines()[0][:200]
    return f"runs are missing: {words}" if isinstance(problem, MissingRuns) else words


def _name_of(make: TableMaker) -> str:
    """Title of a summary; else the function's name."""
    while isinstance(make, partial):
        make = make.func
    return str(getattr(make, "title", "") or getattr(make, "__name__", type(make).__name__))


def _task_name(case: Case, seed: int | None) -> str:
    return case.name if seed is None else f"{case.name}, seed {seed}"


def _names(tasks: Collection[str], cases: Iterable[str]) -> list[str]:
    """Names of the tasks of some cases."""
    some = set(cases)
    return [name for name in tasks if name in some or name.rpartition(", seed ")[0] in some]


def _hashable(value: Any) -> Any:
    return tuple(map(_hashable, value)) if isinstance(value, (list, tuple)) else value


def _plain_call(value: Any) -> Any:
    """A value for JSON; of a partial the function's name and its arguments, of what tells its
    `arguments()` these."""
    if isinstance(value, partial):
        return {"function": value.func.__name__, "arguments": [*value.args, value.keywords]}
    if hasattr(value, "arguments"):
        return value.arguments()
    return value
