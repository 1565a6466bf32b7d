"""The machinery on tiny studies of the catalogue's type: resuming, failing, missing, the page."""

import json
import shutil
import signal
from collections import Counter
from dataclasses import dataclass, field, replace
from itertools import combinations
from pathlib import Path

import cv2
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from rich.table import Table

from cdpr_drake.analyses.reporting.deferred_figures import write_pictures
from cdpr_drake.analyses.reporting.log_files import write_json
from cdpr_drake.analyses.reporting.output_folder import continued_folder
from cdpr_drake.analyses.reporting.statements import Statement
from cdpr_drake.analyses.reporting.written_files import MARKER, mark, others_in
from cdpr_drake.analyses.reproduction import runner
from cdpr_drake.analyses.reproduction.overview import chapter_overviews
from cdpr_drake.analyses.reproduction.page import write_report
from cdpr_drake.analyses.reproduction.rows import report_rows
from cdpr_drake.analyses.reproduction.runner import RunSettings, run_studies
from cdpr_drake.analyses.reproduction.scorecard import LOOKS, VERDICTS, Scorecard, scorecard_figure
from cdpr_drake.analyses.reproduction.states import check_folder, read_state, write_state
from cdpr_drake.analyses.studies.catalogue import StudyEntry
from cdpr_drake.analyses.studies.framework.case_definition import PublishedNumber
from cdpr_drake.analyses.studies.framework.statement import FITTED, OURS
from cdpr_drake.analyses.studies.published.register import published_registers, read_register
from cdpr_drake.errors import OutputFolderError
from tests.analyses.reproduction.judged_rows import judged_rows, said
from tests.analyses.reproduction.killed_processes import exit_code_of, kill_at_change

GREY = (0.299, 0.587, 0.114)
"""What red, green and blue weigh in grey print."""

NUMBER = PublishedNumber(
    group="one", configuration="c", label="C", metric="length_m", heading="length [mm]",
    factor=1e3, format=".1f", printed="2",
)  # fmt: skip

REGISTER = read_register("toy", {
    "title": "A toy thesis <1>",
    "sections": [{
        "section": "1.1",
        "title": "Heights & depths",
        "statements": ["good/high", "good/deep", "bad/high", "late/high", "other/high"],
        "numbers": ["good/one"],
        "items": [
            {"label": "Figure 1.1", "says": "Seen", "figures": ["good/view"],
             "differs": "wider < taller"},
            {"label": "Figure 1.2", "says": "Unseen", "figures": ["good/nothing"]},
            {"label": "Table 1.1", "says": "Both", "answers": ["good/high", "good/low"],
             "figures": ["good/nothing"]},
            {"label": "Table 1.3", "says": "One", "answers": ["good/low", "good/deep"]},
            {"label": "Table 1.4", "says": "Other", "answers": ["good/high", "good/deep"]},
            {"label": "Table 1.2", "says": "Nothing", "missing": "nobody ran it"},
            {"label": "statement", "says": "Others did", "cited": "not done here"},
        ],
    }],
    "own": ["good"],
    "not_drawn": [{"label": "Figure 1.3", "says": "Unprinted", "why": "its poses are lost"}],
    "no_result": ["Figure 1.4"],
})  # fmt: skip


@dataclass
class ToyResult:
    statements: list[Statement]
    interrupted: bool = False

    def as_dict(self):
        run = {"configuration": "c", "camera": "projected", "outcome": "converged"}
        rendered = {**run, "camera": "rendered", "length_m": 1.0}
        return {
            "statements": [one.as_dict() for one in self.statements],
            "runs": [run | {"length_m": length} for length in (0.0019, 0.0023)] + [rendered],
            "assumptions": ["a < b"],
        }

    def tables(self):
        table = Table(title="Numbers <of> it", caption="in all")
        table.add_column("what")
        table.add_row("7 & more")
        return [table]

    def write(self, folder, formats):
        (folder / "results.json").write_text(json.dumps(self.as_dict()))
        cv2.imwrite(str(folder / "view.png"), np.full((20, 1600, 3), 255, np.uint8))


@dataclass
class Toy:
    """A study that counts how often it was run."""

    names: tuple[str, ...] = ()
    fails: bool = False
    interrupted: bool = False
    sessions: list = field(default_factory=list)

    def __call__(self, quick, session):
        self.sessions.append(session)
        session.folder.mkdir(exist_ok=True)
        (session.folder / "kept").touch()
        if self.fails:
            raise RuntimeError("it <broke>\nbadly")
        said = [
            Statement(f"It is {name}.", "yes", "yes & no", verdict, "why", name)
            for name, verdict in zip(self.names, ("confirmed", "not confirmed"), strict=False)
        ]
        return ToyResult(said, self.interrupted)


@pytest.fixture
def folder(tmp_path):
    check_folder(tmp_path / "r", quick=False)
    return tmp_path / "r"


@pytest.fixture
def quick_folder(tmp_path):
    check_folder(tmp_path / "q", quick=True)
    return tmp_path / "q"


def entries(numbers=(NUMBER,), **studies):
    return {
        name: StudyEntry(study, judges=study.names, numbers=numbers)
        for name, study in studies.items()
    }


def reported(folder, studies, register=REGISTER, quick=False):
    """Rows of a reproduction of some studies, and its page."""
    states = run_studies(studies, folder, RunSettings(quick=quick))
    rows = report_rows([register], folder, studies, states)
    return rows, write_report(folder, [register], rows, states, quick=quick).read_text()


def page_of(folder, register, rows):
    return write_report(folder, [register], rows, {}, quick=False).read_text()


def test_what_is_finished_is_taken_over_and_a_failure_is_tried_again(folder):
    good, bad, said = Toy(("high", "low")), Toy(fails=True), []
    studies = entries(bad=bad, good=good)
    first = run_studies(studies, folder, RunSettings(say=said.append))
    assert {name: state.status for name, state in first.items()} == {
        "bad": "failed", "good": "finished"
    }  # fmt: skip
    assert first["bad"].error == "RuntimeError: it <broke>"
    assert "badly" in (folder / "states" / "bad.error.txt").read_text()
    assert first["good"].tables[0]["rows"] == [["7 & more"]]
    bad.fails = False
    again = run_studies(studies, folder, RunSettings(say=said.append))
    assert (len(good.sessions), len(bad.sessions)) == (1, 2)
    assert again["good"].taken_over
    assert again["good"].tables == first["good"].tables
    assert again["bad"].status == "finished"
    assert "good: finished before by the same code, taken over" in said


def test_other_code_runs_a_study_again_and_says_so(folder, monkeypatch):
    good, said = Toy(("high",)), []
    studies = entries(good=good)
    run_studies(studies, folder, RunSettings())
    (folder / "studies" / "good" / "old").touch()
    (folder / "studies" / "good" / ".cdpr_drake.json").write_text("{}")
    monkeypatch.setattr(runner, "code_version", lambda: "other")
    state = run_studies(studies, folder, RunSettings(say=said.append))["good"]
    assert len(good.sessions) == 2
    assert "the code has changed" in state.note
    assert not (folder / "studies" / "good" / "old").exists()


def test_what_was_killed_or_stopped_is_continued(folder):
    slow = Toy(("high",), interrupted=True)
    studies = entries(slow=slow)
    assert run_studies(studies, folder, RunSettings())["slow"].status == "stopped"
    state = json.loads((folder / "states" / "slow.json").read_text())
    (folder / "states" / "slow.json").write_text(json.dumps({**state, "status": "begun"}))
    slow.interrupted = False
    (folder / "studies" / "slow" / "kept").write_text("work")
    state = run_studies(studies, folder, RunSettings())["slow"]
    assert (state.status, state.note) == ("finished", "continued: it was begun before")
    assert (folder / "studies" / "slow" / "kept").read_text() == "work"
    (folder / "states" / "slow.json").write_text("{")  # half written by another program
    assert run_studies(studies, folder, RunSettings())["slow"].status == "finished"


CHANGES = ("open", "os.mkdir", "os.rename", "os.remove", "os.rmdir", "os.chmod")
"""Audit events of Python at which a folder changes, or a file of it is opened."""


class ListedResult(ToyResult):
    """Whose files are known as the program's own."""

    def write(self, folder, formats):
        write_json(folder / "results.json", self.as_dict())
        write_pictures(folder, {"view.png": Path.touch})


def listed_study(quick, session):
    session.folder.mkdir(exist_ok=True)
    mark(session.folder)
    return ListedResult([])


def reproduce(folder, killed_at=None):
    """Runs one study as `cdpr reproduce` does; a number kills the process before that change."""
    kill_at_change(folder, CHANGES, killed_at)
    with continued_folder(folder):
        check_folder(folder, quick=False)
        study = StudyEntry(listed_study)
        run_studies({"one": study}, folder, RunSettings())


def all_files(folder):
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*"))


@pytest.mark.parametrize("older", [False, True])
def test_whatever_instant_kills_it_all_files_are_known_and_none_stays_over(tmp_path, older):
    """The folder is left at each change of it in turn, and then continued; no list loses a file."""
    reproduce(tmp_path / "whole")
    whole, instant, ended = all_files(tmp_path / "whole"), 0, -signal.SIGKILL
    if older:  # by other code
        state = read_state(tmp_path / "whole", "one")
        with continued_folder(tmp_path / "whole"):
            write_state(tmp_path / "whole", replace(state, code="other"))
    while ended == -signal.SIGKILL:
        folder = tmp_path / f"killed-{instant}"
        if older:
            shutil.copytree(tmp_path / "whole", folder)
        ended = exit_code_of(reproduce, folder, instant)
        if (folder / MARKER).exists():
            assert others_in(folder) == [], f"killed before change {instant}"
        reproduce(folder)
        assert others_in(folder) == [], f"continued after change {instant}"
        # Older results are kept until all that was asked for is there.
        left = [name for name in all_files(folder) if not name.startswith("studies/one-before")]
        assert left == whole
        instant += 1
    assert ended == 0
    assert instant > 20  # it was killed at each of them


def test_nothing_is_begun_once_it_shall_stop(folder):
    good = Toy()
    states = run_studies(entries(good=good), folder, RunSettings(should_stop=lambda: True))
    assert (states, good.sessions) == ({}, [])


def test_rows_have_every_item_beside_what_was_found(folder):
    studies = entries(good=Toy(("high", "low")), bad=Toy(fails=True), late=Toy(interrupted=True))
    rows, _ = reported(folder, studies)
    found = {(row.label, row.words): row for row in rows}
    assert [row.verdict for row in rows] == [
        "confirmed", "missing", "study failed", "not finished", "not asked for", "shown", "missing",
        "in part", "not confirmed", "in part", "missing", "cited", "confirmed", "confirmed",
        "not confirmed",
    ]  # fmt: skip
    assert found["statement", "It is high."].found == "yes & no"
    assert found["Figure 1.1", "Seen"].figures == ("studies/good/view.png",)
    assert found["Table 1.1", "Both"].printed == "high: yes; low: yes"
    both = "high: confirmed, yes & no; low: not confirmed, yes & no"
    assert found["Table 1.1", "Both"].found == both
    assert found["Table 1.1", "Both"].why == "low: why; its figure was not drawn"
    assert found["Figure 1.1", "Seen"].differs == "wider < taller"
    assert found["Table 1.4", "Other"].why == "without a verdict here: deep."
    assert found["Table 1.2", "Nothing"].lacks == "nobody ran it"
    assert found["statement", "Others did"].why == "not done here"
    assert found["number", "C: length [mm]"].found == "2.1 (1.9 to 2.3, 2 runs)"
    card = Scorecard.of(rows)
    assert card.total()["missing"] == 3
    assert sum(card.as_dict()["all"].values()) == len(rows)


def test_in_the_quick_form_what_is_not_there_is_not_judged(quick_folder):
    rows, page = reported(quick_folder, entries(good=Toy(("high",))), quick=True)
    found = [row.verdict for row in rows if row.studies == ("good",)]
    assert found.count("not judged in the quick form") == 3  # deep, low, and an unseen figure
    assert "quick form" in page


def test_the_page_holds_its_figures_escapes_words_and_links_files(folder):
    _, page = reported(folder, entries(good=Toy(("high",)), bad=Toy(fails=True)))
    assert page.count("data:image/png;base64,") == 1
    for words in (
        "A toy thesis &lt;1&gt;", "it &lt;broke&gt;", "yes &amp; no", "a &lt; b", "nobody ran it",
        "Differs: wider &lt; taller.", "Figure 1.3: Unprinted. <em>its poses are lost</em>",
        "not repeated: Figure 1.4.", 'id="figure-studies-good-view"',
    ):  # fmt: skip
        assert words in page
    assert not any(f'{word}="http' in page for word in ("src", "href"))
    assert [path.name for path in folder.glob(".*.part")] == []
    links = [part.partition('"')[0] for part in page.split('href="')[1:]]
    assert "#figure-studies-good-view" in links
    files = [link for link in links if not link.startswith("#")]
    assert set(files) >= {"studies/good/results.json", "studies/good/view.png"}
    assert all((folder / file).exists() for file in files)


def test_figures_that_are_asked_for_in_another_format_are_drawn_again(folder):
    class Both(ToyResult):
        def write(self, where, formats):
            super().write(where, formats)
            for ending in formats:
                (where / f"view.{ending}").touch()

    studies, formats = {"good": StudyEntry(giving([Both] * 4))}, []
    for asked in (("png",), ("png", "pdf"), ("png", "pdf"), ("png",)):
        state = run_studies(studies, folder, RunSettings(formats=asked))["good"]
        formats.append((state.taken_over, (folder / "studies/good/view.pdf").is_file()))
    assert formats == [(False, False), (False, True), (True, True), (True, True)]


def giving(results):
    """A study that gives results of these kinds, one after the other."""

    def study(quick, session):
        session.folder.mkdir(exist_ok=True)
        return results.pop(0)([])

    return study


def test_a_study_whose_figures_could_not_be_written_is_not_taken_over(folder):
    class Full(ToyResult):
        def write(self, where, formats):
            super().write(where, formats)
            raise OSError(28, "No space left on device")

    studies = {"good": StudyEntry(giving([Full, ToyResult]))}
    first = run_studies(studies, folder, RunSettings())["good"]
    assert first.status == "finished"
    assert first.error == "figures: [Errno 28] No space left on device"
    again = run_studies(studies, folder, RunSettings())["good"]
    assert (again.status, again.error, again.taken_over) == ("finished", "", False)


def test_a_folder_of_the_other_form_or_of_others_is_refused(folder, tmp_path):
    with pytest.raises(OutputFolderError, match="holds a reproduction in the full form"):
        check_folder(folder, quick=True)
    check_folder(folder, quick=False)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").touch()
    with pytest.raises(OutputFolderError, match="did not write"):
        check_folder(tmp_path / "mine", quick=False)
    (tmp_path / "file").touch()
    with pytest.raises(OutputFolderError, match="found a file"):
        check_folder(tmp_path / "file", quick=False)
    assert Path(tmp_path / "mine" / "thesis.txt").exists()


def test_states_compare_without_how_they_were_come_by(folder):
    state = run_studies(entries(good=Toy()), folder, RunSettings())["good"]
    assert replace(state, taken_over=True) == state


def test_a_fact_is_counted_once_however_many_items_rest_on_it(folder):
    _, rows = judged_rows(
        folder,
        one=[said("high", [True]), said("near", [True], FITTED), said("wide", [True], OURS)],
        two=[said("again", [True], same_as="one/high"), said("low", [True, False])],
    )
    assert [row.repeats for row in rows] == [False, False, False, True, False, True]
    card = Scorecard.of(rows)
    assert card.total_facts() == {"confirmed": 1, "met (fitted)": 1, "in part": 1}
    assert card.total_facts("ours") == {"confirmed": 1}
    assert card.independent == 1
    assert card.total().total() == 6
    assert rows[-1].verdict == "in part"


def test_a_table_is_as_good_as_the_weakest_and_the_page_has_all_tolerances(folder):
    register, rows = judged_rows(
        folder,
        one=[said("high", [True], rule="within 3 mm <half>"), said("near", [True], FITTED)],
    )
    assert rows[-1].verdict == "met (fitted)"
    page = page_of(folder, register, rows)
    assert "within 3 mm &lt;half&gt;" in page
    assert page.count("counted above") == 1


def test_a_chapter_says_what_stands_and_why_what_fails(folder):
    register, rows = judged_rows(
        folder,
        one=[said("high", [True]), said("near", [True], FITTED)],
        two=[said("low", [False], cause="hardware"), said("odd", [True, False])],
    )
    register = replace(register, corrected={"1": ("(1.2)",), "2": ("(2.1)",)})
    page = page_of(folder, register, rows)
    start = page.index('<h2 id="chapters">')
    words = page[start : page.index("<h2", start + 1)]
    assert "<b>Stands, 1</b>: It is high." in words
    assert "<b>Met, but not put to a test, 1</b>: It is near." in words
    assert "<b>Corrected, 1</b>: (1.2)." in words
    assert "<b>Fails, 1</b>, because of the prototype, which has what is in no model" in words
    assert "<b>Holds in part, 1</b>, for a reason that is not known" in words
    assert "Chapter 2" in words


def test_what_is_fitted_or_counted_above_is_marked_in_words(folder):
    register, rows = judged_rows(
        folder, one=[said("near", [False], FITTED), said("met", [True], FITTED)]
    )
    page = page_of(folder, register, rows)
    lines = page[page.index('<table class="items">') :].split("<tr")[2:5]
    assert ['<span class="mark">fitted</span>' in line for line in lines] == [True, False, True]
    assert "met (fitted)" in lines[1]
    assert ["counted above" in line for line in lines] == [False, False, True]


def test_beside_a_figure_stand_the_printed_numbers_of_its_runs_and_ours(folder):
    several = tuple(replace(NUMBER, label=f"C{k}") for k in range(6))
    for numbers, more in (((NUMBER,), ""), (several, "; 2 more below")):
        rows, _ = reported(folder, entries(numbers, good=Toy(("high", "low"))))
        found = {row.label: row for row in rows}
        first = numbers[0].label
        assert found["Figure 1.1"].printed.startswith(f"{first}, length [mm]: 2")
        assert found["Figure 1.1"].found.startswith(f"{first}, length [mm]: 2.1 (1.9 to 2.3, 2 ru")
        assert found["Figure 1.1"].printed.endswith(more)
        assert found["Figure 1.1"].verdict == "shown"  # the numbers have rows of their own
        assert found["Table 1.1"].printed == "high: yes; low: yes"
        assert found["Table 1.3"].printed == "low: yes"


def test_a_printed_number_that_is_not_confirmed_has_its_cause(folder):
    causes = {}
    for printed in ("2", "9"):
        number = replace(NUMBER, printed=printed, why="it slips", cause="hardware")
        rows, _ = reported(folder, entries((number,), good=Toy()))
        (row,) = [row for row in rows if row.label == "number"]
        causes[row.verdict] = row.facts[0].cause
    assert causes == {"confirmed": "", "not confirmed": "hardware"}


def test_what_was_not_asked_for_is_folded_and_counted(folder):
    rows, page = reported(folder, entries(late=Toy(("high",))))
    count = sum(row.verdict == "not asked for" for row in rows)
    assert f"<summary>Not asked for: {count} items of 3 studies</summary>" in page
    assert "<b>other</b>, 1: statement" in page
    whole = page[page.index('<table class="items">') :]
    assert "cdpr reproduce --only" not in whole
    assert "Stands" in page  # what was asked for is told


@pytest.mark.parametrize(("count", "folded"), [(3, 0), (4, 1)])
def test_what_the_quick_form_cannot_judge_is_folded_where_it_is_long(quick_folder, count, folded):
    answers = [f"good/low{k}" for k in range(count)]
    register = read_register("toy", {"title": "Toy", "sections": [
        {"section": "1.1", "title": "One", "statements": ["good/high", *answers]}
    ]})  # fmt: skip
    _, page = reported(quick_folder, entries(good=Toy(("high",))), register, quick=True)
    assert page.count("items that are judged in the full form only</summary>") == folded


def test_chapters_count_each_fact_where_the_scorecard_does(folder):
    _, rows = judged_rows(
        folder,
        one=[said("high", [True]), said("wide", [True], OURS), said("low", [True, False])],
        two=[said("again", [True], same_as="one/high"), said("odd", [])],
    )
    later = [replace(row, chapter="2") for row in rows]
    register = replace(REGISTER, corrected={})
    overviews = chapter_overviews([*rows, *later], [register])
    counted = {o.chapter: sum(len(group.facts) for group in o.groups) for o in overviews}
    facts = Scorecard.of([*rows, *later]).facts
    assert counted == {"1": facts["toy", "1"].total()} == {"1": 3}


def test_the_picture_of_the_scorecard_counts_every_fact_in_a_look_of_its_own():
    registers = published_registers()
    places = dict.fromkeys((one.name, s.chapter) for one in registers for s in one.sections)
    counts = {place: Counter({v: k + 1 for k, v in enumerate(VERDICTS)}) for place in places}
    total = sum(range(len(VERDICTS) + 1))
    (axes,) = scorecard_figure(Scorecard({}, counts, 0), registers, quick=True).axes
    assert sum(bar.get_width() for bar in axes.patches) == total * len(places)
    assert len(axes.get_yticks()) == len(places)
    assert [text.get_text() for text in axes.texts].count(str(total)) == len(places)
    # In grey print: a hatch, or lightness that differs by a tenth from all others with this hatch.
    assert set(LOOKS) == set(VERDICTS)
    for look, other in combinations(LOOKS.values(), 2):
        if look.hatch == other.hatch:
            assert abs(np.dot(GREY, np.subtract(to_rgb(look.color), to_rgb(other.color)))) > 0.1
