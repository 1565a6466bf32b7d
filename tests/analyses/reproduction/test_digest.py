"""The digest: what stands in it, and the PDF that is made of it."""

from __future__ import annotations

import signal
from pathlib import Path

import cv2
import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.ft2font import FT2Font

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
from cdpr_drake.analyses.reproduction.states import StudyState, check_folder
from cdpr_drake.analyses.studies.framework.statement import FITTED, OURS
from cdpr_drake.analyses.studies.published.register import published_registers
from cdpr_drake.errors import OutputFormatError
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
