"""A report beside an older one."""

from __future__ import annotations

import json

import pytest

from cdpr_drake.analyses.front.reproduction import Reproduction
from cdpr_drake.analyses.reporting.log_files import write_json
from cdpr_drake.analyses.reproduction.digest_story import Grid, Words, digest_story
from cdpr_drake.analyses.reproduction.older import SUMMARY, change_words, changed_facts, read_older
from cdpr_drake.analyses.reproduction.page import write_report
from cdpr_drake.analyses.reproduction.scorecard import Scorecard
from cdpr_drake.errors import OutputFolderError
from tests.analyses.reproduction.judged_rows import judged_rows, said


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
