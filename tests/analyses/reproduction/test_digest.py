"""The digest, the PDF that is made of it, and a report beside an older one."""

import json
import signal
from pathlib import Path

import cv2
import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.ft2font import FT2Font

from cdpr_drake.analyses.front.reproduction import Reproduction
from cdpr_drake.analyses.reporting.log_files import write_json
from cdpr_drake.analyses.reporting.output_folder import continued_folder
from cdpr_drake.analyses.reporting.written_files import others_in
from cdpr_drake.analyses.reproduction import digest_pdf
from cdpr_drake.analyses.reproduction.digest_pdf import DIGEST, FONTS, NO_REPORTLAB, write_digest
from cdpr_drake.analyses.reproduction.digest_story import (
    TELLING,
    Drawing,
    Grid,
    Heading,
    Picture,
    Title,
    Words,
    digest_story,
)
from cdpr_drake.analyses.reproduction.older import SUMMARY, change_words, changed_facts, read_older
from cdpr_drake.analyses.reproduction.page import write_report
from cdpr_drake.analyses.reproduction.scorecard import Scorecard
from cdpr_drake.analyses.reproduction.states import StudyState, check_folder
from cdpr_drake.analyses.studies.framework.statement import FITTED, OURS
from cdpr_drake.analyses.studies.published.register import published_registers
from cdpr_drake.errors import OutputFolderError, OutputFormatError
from tests.analyses.reproduction.judged_rows import judged_rows, said
from tests.analyses.reproduction.killed_processes import exit_code_of, kill_at_change


@pytest.fixture
def folder(tmp_path):
    check_folder(tmp_path / "r", quick=False)
    return tmp_path / "r"


def story_of(folder):
    register, rows = judged_rows(
        folder,
        one=[
            said("high", [True], rule="within 3 mm <half>"),
            said("near", [True], FITTED),
            said("tried", [True], OURS, rule="only asked by us"),
            said("fitted_low", [False], FITTED, cause="ours"),
        ],
        two=[said("low", [False], cause="hardware"), said("odd", [True, False])],
    )
    states = {name: StudyState(name, "finished", quick=False, code="1") for name in ("one", "two")}
    states["bad"] = StudyState("bad", "failed", quick=False, code="1", error="it broke")
    return digest_story(folder, [register], rows, states, quick=False)


def words_of(story):
    return "\n".join(
        f"{block.lead}{block.words}" if isinstance(block, Words) else block.words
        for block in story
        if not isinstance(block, Grid)
    )


def cells_of(story, heading):
    """The lines of the first table below a heading."""
    words = [block.words if isinstance(block, Heading) else "" for block in story]
    start = next(k for k, one in enumerate(words) if one.startswith(heading))
    return next(block for block in story[start:] if isinstance(block, Grid)).lines


def test_the_digest_says_what_stands_and_why_what_fails(folder):
    words = words_of(story_of(folder))
    assert "Of 5 facts of the sources 1 are confirmed by runs" in words
    assert "Toy, Chapter 1" in words
    assert "Stands, 1: It is high." in words
    assert "Fails, 1, because of the prototype, which has what is in no model: It is low." in words
    assert "Fails, 1, because of a choice of ours: It is fitted_low." in words
    assert "Holds in part, 1, for a reason that is not known" in words
    assert "Studies: 2 finished, 1 failed." in words
    assert "Study failed: bad: it broke" in words


def test_the_digest_counts_facts_once_and_names_the_cause(folder):
    story = story_of(folder)
    card = cells_of(story, "Scorecard")
    assert card[-1] == ("All of the sources", "5", "1", "1", "1", "2")
    assert cells_of(story, "Not confirmed: 2") == (
        ("toy 1.1", "It is fitted_low (fitted)", "", "so", "ours", ""),
        ("toy 1.1", "It is low", "", "so", "hardware", ""),
    )
    assert [line[2] for line in cells_of(story, "Confirmed in part: 1")] == ["not known"]
    assert any(
        isinstance(one, Words) and "Rules of statements, 1, are" in one.words for one in story
    )
    assert any(isinstance(block, Drawing) for block in story)


def test_the_same_story_gives_the_same_bytes_of_selectable_text(folder, tmp_path):
    cv2.imwrite(str(tmp_path / "view.png"), np.full((40, 3000, 3), 99, np.uint8))
    pictures = [Picture(tmp_path / "view.png", "a < b"), Picture(tmp_path / "none.png", "gone")]
    story = [*story_of(folder), *pictures, Words("ω̇ = −π/2 · Δe ≤ 5 °, <b> & Ünïcode ✓")]
    for name in ("first.pdf", "second.pdf"):
        write_digest(tmp_path / name, story)
    content = (tmp_path / "first.pdf").read_bytes()
    assert content == (tmp_path / "second.pdf").read_bytes()
    assert content.startswith(b"%PDF-")
    assert content.rstrip().endswith(b"%%EOF")
    assert content.count(b"/ToUnicode") >= 2  # letters, not shapes alone
    assert b"/FontFile2" in content


def test_long_tables_and_words_without_a_gap_are_typeset(tmp_path):
    long = Grid(("a", "b"), tuple(("x" * 300, str(k)) for k in range(300)), (0.1, 0.9), numbers=1)
    write_digest(tmp_path / "long.pdf", [Title("Long"), Heading("One"), long, Heading("Two")])
    assert (tmp_path / "long.pdf").stat().st_size > 10_000


def test_without_reportlab_it_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setattr(digest_pdf, "find_spec", lambda name: None)
    with pytest.raises(OutputFormatError, match="reportlab is not installed: pip install"):
        write_digest(tmp_path / "digest.pdf", [])
    assert list(tmp_path.iterdir()) == []
    assert "cdpr_drake[report]" in NO_REPORTLAB


def test_telling_figures_are_of_the_register():
    drawn = {
        key
        for register in published_registers()
        for section in register.sections
        for item in section.items
        for key in item.figures
    }
    assert {key for key, _ in TELLING} <= drawn


def test_the_fonts_have_every_character_of_what_was_published():
    folder = Path(mpl.get_data_path()) / "fonts" / "ttf"
    words = "".join(
        f"{register.title}{item.says}{item.differs}"
        for register in published_registers()
        for section in register.sections
        for item in section.items
    )
    for file in FONTS.values():
        assert {ord(one) for one in words} <= set(FT2Font(str(folder / file)).get_charmap())


CHANGES = ("open", "os.rename", "os.remove")
"""Audit events of Python at which the folder changes, or a file of it is opened."""


def put_digest(folder, story, killed_at=None):
    """Writes the digest as a reproduction does; a number kills the process before that change."""
    from cdpr_drake.analyses.reporting.deferred_figures import write_pictures

    with continued_folder(folder):
        check_folder(folder, quick=False)
        kill_at_change(folder, CHANGES, killed_at)
        write_pictures(folder, {DIGEST: lambda path: write_digest(path, story)})


def test_whatever_instant_kills_it_the_digest_is_whole_or_the_older_one(tmp_path):
    story, older = [Title("New"), Words("new")], [Title("Old"), Words("old")]
    for name, some in (("new", story), ("old", older)):
        put_digest(tmp_path / name, some)
    whole = {(tmp_path / name / DIGEST).read_bytes() for name in ("new", "old")}
    assert len(whole) == 2
    instant, ended = 0, -signal.SIGKILL
    while ended == -signal.SIGKILL:
        folder = tmp_path / f"killed-{instant}"
        put_digest(folder, older)
        ended = exit_code_of(put_digest, folder, story, instant)
        assert (folder / DIGEST).read_bytes() in whole
        put_digest(folder, story)
        assert others_in(folder) == []
        assert not list(folder.glob(".part-*"))
        instant += 1
    assert ended == 0
    assert instant > 3  # it was killed at each of them


@pytest.fixture
def older(tmp_path):
    folder = tmp_path / "older"
    folder.mkdir()
    _, rows = judged_rows(
        folder, one=[said("high", [False]), said("deep", [True]), said("gone", [True])]
    )
    write_json(folder / SUMMARY, Reproduction(False, rows, {}, folder).as_dict())
    return folder


@pytest.fixture
def now(tmp_path):
    folder = tmp_path / "now"
    folder.mkdir()
    return folder, *judged_rows(
        folder,
        one=[said("high", [True]), said("deep", [True]), said("new", [True]), said("n", [False])],
    )


def test_a_summary_is_read_as_it_was_counted(older):
    read = read_older(older)
    assert read == read_older(older / SUMMARY)
    content = json.loads((older / SUMMARY).read_text())
    assert read.card.as_dict() == content["scorecard"]
    assert read.verdicts["one/high"] == "not confirmed"
    assert not read.quick


def test_what_changed_is_told(older, now):
    _, _, rows = now
    changed = changed_facts(rows, read_older(older))
    assert [(one.placed.words, one.before, one.placed.fact.verdict) for one in changed] == [
        ("It is high", "not confirmed", "confirmed")
    ]
    words = change_words(rows, read_older(older))
    assert words.endswith("1 facts have another verdict, 2 are new, 1 are there no more.")


def test_the_page_has_older_counts_where_they_differ(older, now):
    folder, register, rows = now
    page = write_report(folder, [register], rows, {}, False, read_older(older)).read_text()
    line = page[page.index("<td>Chapter 1</td>") :].partition("</tr>")[0]
    assert "4 <small>was 3</small>" in line
    assert "3 <small>was 2</small>" in line
    assert line.count("was") == 2  # one is not confirmed, as before
    changes = page[page.index('<h2 id="changes">') :].partition("<h2")[2].partition("<h2")[0]
    assert "<td>one/high</td><td>It is high</td><td>not confirmed</td><td>confirmed</td>" in changes
    alone = write_report(folder, [register], rows, {}, False).read_text()
    assert "<small>was" not in alone
    assert 'id="changes"' not in alone


def test_a_verdict_that_no_fact_has_any_more_keeps_its_column(older, now):
    folder, register, rows = now
    good = [row for row in rows if row.words != "It is n." and row.label == "statement"]
    page = write_report(folder, [register], good, {}, False, read_older(older)).read_text()
    assert "0 <small>was 1</small>" in page
    story = digest_story(folder, [register], good, {}, False, read_older(older))
    grid = next(block for block in story if isinstance(block, Grid))
    assert grid.lines[0] == ("Chapter 1", "3", "3 (2)", "0 (1)")


def test_the_digest_has_older_counts_in_brackets(older, now):
    folder, register, rows = now
    story = digest_story(folder, [register], rows, {}, False, read_older(older))
    grids = [block for block in story if isinstance(block, Grid)]
    assert grids[0].lines[0] == ("Chapter 1", "4 (3)", "3 (2)", "1")
    assert grids[1].lines == (("It is high", "not confirmed", "confirmed"),)
    assert any("In brackets" in block.words for block in story if isinstance(block, Words))


def test_reports_that_counted_items_alone_are_read(older, now):
    folder, register, rows = now
    content = json.loads((older / SUMMARY).read_text())
    del content["scorecard"]["facts"]
    for item in content["items"]:
        del item["facts"]
    (older / SUMMARY).write_text(json.dumps(content))
    read = read_older(older)
    assert read.card == Scorecard(read.card.chapters, {}, 0)
    page = write_report(folder, [register], rows, {}, False, read).read_text()
    facts, _, items = page.partition("Figures, tables, numbers and sentences")
    assert "<small>was" not in facts
    assert "5 <small>was 4</small>" in items
    assert "counted items" in facts


@pytest.mark.parametrize(
    "content",
    ["{", "[]", "null", '{"items": []}', '{"items": [], "code": "1", "quick": false}',
     '{"items": [1], "code": "1", "quick": false, "scorecard": {"chapters": []}}',
     '{"items": [], "code": "1", "quick": false, "scorecard": {"chapters": [{"source": "a"}]}}',
     '{"items": [], "code": "1", "quick": false, "scorecard": '
     '{"chapters": [{"source": "a", "chapter": "1", "confirmed": "many"}]}}'],
)  # fmt: skip
def test_what_is_no_summary_is_refused_in_a_line(tmp_path, content):
    (tmp_path / SUMMARY).write_text(content)
    for path in (tmp_path, tmp_path / SUMMARY):
        with pytest.raises(OutputFolderError, match="found no summary of a report; accepted") as e:
            read_older(path)
        assert "\n" not in str(e.value)


def test_what_is_not_there_or_not_text_is_refused_in_a_line(tmp_path):
    with pytest.raises(OutputFolderError, match="cannot be read: No such file"):
        read_older(tmp_path / "none")
    (tmp_path / "view.png").write_bytes(b"\x89PNG\xff\xfe")
    with pytest.raises(OutputFolderError, match="found no summary"):
        read_older(tmp_path / "view.png")
