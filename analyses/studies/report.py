"""The report of a reproduction: all studies, and one page with the facts of all sources.

The page holds its pictures, so that it opens anywhere; printed by a browser it is the PDF.
"""

from __future__ import annotations

import base64
import io
import json
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import jinja2
import pandas as pd

from cdpr_drake.analyses.frame.folder import Folder
from cdpr_drake.analyses.frame.follow import NOBODY, Follow, Progress
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import DEFAULT_FORMATS
from cdpr_drake.analyses.reporting.provenance import browser, code_version, package_versions
from cdpr_drake.analyses.studies.facts import GOOD, Entry, Fact, sources
from cdpr_drake.analyses.studies.study import RESULTS, STUDIES, run_study
from cdpr_drake.errors import CdprError
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.schema.typed_yaml import closest
from cdpr_drake.summaries import Summarized

PAGE, VERDICTS_FILE = "report.html", "facts.json"

VERDICTS = (
    *dict.fromkeys(GOOD.values()), "in part", "not confirmed", "shown", "cited", "missing",
    "not judged", "not judged in the quick form", "interrupted", "not run",
)  # fmt: skip
"""All verdicts, in the order of the page."""

CAUSES = {
    "source": "the source leaves out what is needed, or contradicts itself",
    "hardware": "the prototype has what no model has",
    "ours": "a choice of ours",
    "not known": "not known",
}

COLORS = 64
"""Colours of a picture in the page: one with more looks the same, and takes thrice the room."""


@dataclass(frozen=True, eq=False, repr=False)
class Reproduction(Summarized):
    """All studies, and what sources say beside it.

    Attributes:
        folder: The results folder, with a folder for each study.
        quick: True if studies were run in their short forms.
        chapters: Of each section of a source its title and the rows of its facts and entries.
        results: What each study wrote; None if it has not run.
        failed: Words by study, if a study could not run.
        left: Studies that did not run, or not to the end.
        undrawn: Of files of studies that were not written, "study/file" and why.
    """

    folder: Path
    quick: bool
    chapters: Sequence[Mapping[str, Any]]
    results: Mapping[str, dict[str, Any] | None]
    failed: Mapping[str, str] = field(default_factory=dict)
    left: Sequence[str] = ()
    undrawn: Mapping[str, str] = field(default_factory=dict)

    @property
    def page(self) -> Path:
        """The report."""
        return self.folder / PAGE

    def facts(self) -> list[dict[str, Any]]:
        """Rows of facts, each once."""
        return [row for chapter in self.chapters for row in chapter["rows"] if row["key"]]

    def counts(self) -> pd.DataFrame:
        """How many facts have which verdict: a row for each source and section, a column each."""
        facts = pd.DataFrame(self.facts(), columns=["source", "section", "verdict"])
        places = [facts["source"], facts["section"]]
        table = pd.get_dummies(facts["verdict"], dtype=int).groupby(places, sort=False).sum()
        return table[[verdict for verdict in VERDICTS if verdict in table]]

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself: verdicts of each source, and what did not run."""
        return f"Reproduction by {len(self.results)} studies", [
            *((title, _in_words(count)) for title, count in by_source(self.counts()).iterrows()),
            ("failed", ", ".join(self.failed) or "none"),
            ("left", ", ".join(self.left) or "none"),
            ("report", str(self.page)),
        ]

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON."""
        return {
            "quick": self.quick, "code": code_version(), "versions": package_versions(),
            "facts": self.facts(),
            "verdicts": by_source(self.counts()).to_dict("index"),
            "studies": {name: result is not None for name, result in self.results.items()},
            "failed": dict(self.failed), "left": list(self.left),
        }  # fmt: skip


@verb()
def reproduce(
    folder: Path | str, quick: bool = False, only: Sequence[str] | None = None, *,
    workers: int | str | None = None, overwrite: bool = False,
    formats: Sequence[str] = DEFAULT_FORMATS, runs_from: Path | str | None = None,
    against: Path | str | None = None, follow: Follow = NOBODY,
) -> Reproduction:  # fmt: skip
    """Runs every study, and writes one page on what sources print beside what is found.

    Studies of the same code are not run again; the same call goes on where it was stopped. A study
    that cannot run does not end the others.

    Args:
        folder: Results folder.
        quick: Studies in their short forms.
        only: Names of some studies alone; None: all.
        workers: Processes, a Dask scheduler, or None: one for each processor.
        overwrite: True to replace results of other code.
        formats: Endings of the figures' files; the page needs png.
        runs_from: Folder of a reproduction by other code, whose rows of equal calls are taken over.
        against: `facts.json` of an older reproduction: the page says which verdicts changed.
        follow: Who follows.

    Raises:
        CdprError: A study is unknown, or the folder is not accepted.
    """
    names = list(STUDIES) if only is None else list(only)
    if not names:
        raise CdprError("only: found none; accepted: names of studies")
    for name in names:
        if name not in STUDIES:
            raise CdprError(f"only: study {name!r} is unknown; {closest(name, STUDIES)}")
    older = {} if against is None else _older(Path(against))
    arguments = {"reproduction": names, "quick": quick}
    failed, undrawn, left, ran = dict[str, str](), dict[str, str](), list[str](), list[str]()
    with Folder(Path(folder), arguments, overwrite, grows=True) as results:
        for number, name in enumerate(names):
            if follow.stop():
                left.append(name)
                continue
            words = f"{number + 1}/{len(names)} {name}"
            told = _named(follow, words)
            earlier = None if runs_from is None else Path(runs_from) / name
            try:
                found = run_study(
                    name, results.claim(name), quick, workers=workers, overwrite=overwrite,
                    formats=tuple(dict.fromkeys([*DEFAULT_FORMATS, *formats])),
                    runs_from=earlier if earlier and earlier.is_dir() else None, follow=told,
                )  # fmt: skip
            except Exception as problem:  # whatever a study stumbles over
                kind = "" if isinstance(problem, CdprError) else f"{type(problem).__name__}: "
                failed[name] = f"{kind}{problem}"
                follow.say(f"{name}: {failed[name]}")
                continue
            ran.append(name)
            undrawn |= {f"{name}/{file}": why for file, why in found.undrawn.items()}
            if found.failed:
                failed[name] = "; ".join(found.failed.values())
            if found.stopped:
                left.append(name)
        report = reproduction_of(results.path, names, ran, quick, failed, left, older)
        results.write_text(VERDICTS_FILE, _json(_verdicts(report.facts())))
        results.write_text(PAGE, page_of(report))
        if not failed and not left and not undrawn:
            results.complete()
    return replace(report, undrawn=undrawn)


def _named(follow: Follow, words: str) -> Follow:
    """Who follows, told with words before each line."""

    def progress(now: Progress) -> None:
        follow.progress(replace(now, what=f"{words}: {now.what}"))

    return replace(follow, progress=progress, say=lambda line: follow.say(f"{words}: {line}"))


def reproduction_of(
    folder: Path, names: Sequence[str], ran: Sequence[str], quick: bool, failed: Mapping[str, str],
    left: Sequence[str], older: Mapping[str, str],
) -> Reproduction:  # fmt: skip
    """What the studies in a folder say of all sources."""
    results = {name: _read_json(folder / name / RESULTS) if name in ran else None for name in names}
    chapters = []
    for source in sources():
        for section, entries in source.sections.items():
            rows = [_row(folder, entry, results) for entry in entries if entry.studies() & {*names}]
            for row in rows:
                row |= {"source": source.title, "section": section}
                row["was"] = older.get(row["key"], row["verdict"])
            if rows:
                chapters.append({"source": source.title, "section": section, "rows": rows})
    return Reproduction(folder, quick, chapters, results, failed, left)


def _row(folder: Path, entry: Entry, results: Mapping[str, Any]) -> dict[str, Any]:
    """A fact or an entry of a source with what came of it."""
    figures = [name for name in entry.figures if (folder / f"{name}.png").is_file()]
    row: dict[str, Any] = {
        "key": "", "says": entry.says, "at": entry.at, "figures": figures, "differs": entry.differs,
    }  # fmt: skip
    if not isinstance(entry, Fact):
        why = entry.cited or entry.missing
        verdict = "shown" if figures else "not run"
        verdict = "cited" if entry.cited else "missing" if entry.missing else verdict
        return {**row, "verdict": verdict, "why": why}
    row |= {"key": f"{entry.study}/{entry.name}", "basis": entry.basis, "reason": entry.reason}
    result = results.get(entry.study)
    judged = () if result is None else (s for s in result["statements"] if s["name"] == entry.name)
    return row | next(iter(judged), {"verdict": "not run"})


def page_of(report: Reproduction) -> str:
    """The page, with its pictures."""
    facts = report.facts()
    loader = jinja2.FileSystemLoader(Path(__file__).parent)
    templates = jinja2.Environment(
        loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    tables = {
        name: (report.folder / name / "tables.html").read_text(encoding="utf-8")
        for name, result in report.results.items()
        if result is not None
    }
    return templates.get_template("report.html.j2").render(
        report=report,
        facts=facts,
        verdicts=VERDICTS,
        counts=report.counts(),
        by_source=by_source(report.counts()),
        failed=_by_cause(facts),
        changed=[row for row in facts if row["was"] != row["verdict"]],
        versions={**package_versions(), "code": code_version()},
        picture=_picture,
        tables=tables,
    )


def by_source(counts: pd.DataFrame) -> pd.DataFrame:
    """Counts of all sections of each source."""
    return counts.groupby(level="source", sort=False).sum()


def _in_words(counts: pd.Series) -> str:
    return ", ".join(f"{count} {verdict}" for verdict, count in counts.items() if count)


def _by_cause(facts: Sequence[Mapping[str, Any]]) -> list[tuple[str, list[Mapping[str, Any]]]]:
    """Facts that do not hold, by the kind of their cause, in words."""
    failed = [row for row in facts if row["verdict"] in ("in part", "not confirmed")]
    groups = [
        (words, [row for row in failed if row["cause"].startswith(kind)])
        for kind, words in CAUSES.items()
    ]
    return [(words, rows) for words, rows in groups if rows]


def _verdicts(facts: Iterable[Mapping[str, Any]]) -> dict[str, str]:
    return {row["key"]: row["verdict"] for row in facts}


def _older(path: Path) -> dict[str, str]:
    file = path / VERDICTS_FILE if path.is_dir() else path
    found = _read_json(file)
    if not isinstance(found, dict):
        raise CdprError(f"against: {path}: found no {VERDICTS_FILE}; accepted: a report's folder")
    return found


def _read_json(path: Path) -> dict[str, Any] | None:
    try:
        found: dict[str, Any] = load_json(path.read_text(encoding="utf-8"))
        return found
    except (OSError, ValueError):
        return None


def _json(value: Any) -> str:
    return json.dumps(value, indent=1) + "\n"


def _picture(path: Path) -> str:
    """A figure as an address that holds it."""
    from PIL import Image

    file = io.BytesIO()
    Image.open(path).convert("RGB").quantize(COLORS).save(file, "PNG", optimize=True)
    return f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}"


def print_pdf(page: Path) -> Path | None:
    """Prints a page by a browser of this machine; None without one."""
    program = browser()
    if program is None:
        return None
    pdf = page.with_suffix(".pdf")
    options = ["--headless", "--no-sandbox", "--no-pdf-header-footer", f"--print-to-pdf={pdf}"]
    subprocess.run([program, *options, page.resolve().as_uri()], check=True, capture_output=True)
    return pdf
