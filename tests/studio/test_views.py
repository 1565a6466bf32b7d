"""A folder with results in the page: what is read of it, and what a user then sees."""

import io
import json
import zipfile

import pytest
from nicegui import ui

from cdpr_drake.errors import CdprError
from cdpr_drake.studio.views import read_results, show_results
from tests.studio.pages import field, shown, simulated, until

STATEMENT = {"words": "<b>says</b>", "printed": "1", "found": "2", "verdict": "confirmed"}


@pytest.fixture
def study(tmp_path):
    """The folder of a study, whose words are not harmless and whose links lead out of it."""
    folder = tmp_path / "some"
    folder.mkdir()
    results = {
        "study": "some", "quick": True, "spread_m": 1.25, "rows": {"done": 3, "of": 4},
        "statements": [STATEMENT, STATEMENT | {"verdict": "in part"}],
        "parts": {"a": {"x": 1}, "b": {"y": 2}},
        "cables": {"C1": {"length_m": 0.5}, "C2": {"length_m": None}},
        "runs": [{"seed": k, "summary": {"no": 1}} for k in range(100)],
    }  # fmt: skip
    (folder / "results.json").write_text(json.dumps(results))
    (folder / "a.svg").write_text("<svg xmlns='http://www.w3.org/2000/svg'/>")
    (folder / "replay.html").write_text("<p>moves</p>")
    (folder / ".hidden").write_text("")
    (folder / "outside.png").symlink_to("/etc/hostname")
    return folder


def test_a_folder_has_facts_verdicts_tables_and_files(study):
    results = read_results(study)
    assert results.facts == [
        ("study", "some"), ("quick", "yes"), ("spread [m]", "1.25"), ("rows done", "3"),
        ("rows of", "4"), ("parts a x", "1"), ("parts b y", "2"),
    ]  # fmt: skip
    assert results.verdicts() == "1 confirmed, 1 in part"
    assert results.remarks() == "short form"
    heads, rows = results.tables["runs, the first 60 of 100 rows"]
    assert (heads, len(rows), rows[-1]) == (["seed"], 60, ["59"])
    cables = results.tables["cables, 2 rows"]
    assert cables == (["cables", "length [m]"], [["C1", "0.5"], ["C2", "–"]])
    assert list(results.files) == ["a.svg", "replay.html", "results.json"]
    assert list(results.figures) == ["a.svg"]


@pytest.mark.parametrize(
    "words", ["", "[]", "\xff", "[" * 100_000], ids=["none", "list", "", "deep"]
)
def test_broken_results_are_one_message(tmp_path, words):
    (tmp_path / "results.json").write_text(words, encoding="latin-1")
    with pytest.raises(CdprError, match=r"results\.json: "):
        read_results(tmp_path)


async def test_a_user_sees_verdicts_figures_and_files_and_nothing_in_them_is_run(study):
    async with simulated(lambda: ui.timer(0.0, lambda: show_results(study), once=True)) as user:
        await until(lambda: shown(user, "shown-figure"))
        assert "image/svg+xml" in field(user, "shown-figure").content
        words = field(user, "statements").content
        assert "confirmed" in words
        assert "&lt;b&gt;says" in words
        field(user, "page-replay.html").value = True
        await until(lambda: shown(user, "result-page"))
        page = field(user, "result-page").props
        assert (page["srcdoc"], page["sandbox"]) == ("<p>moves</p>", "allow-scripts")
        user.find("All as a zip archive").click()
        sent = await user.download.next(timeout=1200.0)
    with zipfile.ZipFile(io.BytesIO(sent.content)) as archive:  # which follows no link
        names = {"results.json", "a.svg", "replay.html", ".hidden"}
        assert {f"some/{name}" for name in names} == set(archive.namelist())
