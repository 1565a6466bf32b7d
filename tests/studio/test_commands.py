"""Forms of commands, and what commands left: without a page."""

import json
import sys

import numpy as np
import pytest

from cdpr_drake.analyses.visualization.meshcat_window import open_meshcat
from cdpr_drake.cli.app import main
from cdpr_drake.cli.call import shown_arguments
from cdpr_drake.cli.command_forms import LEFT_OUT, command_forms
from cdpr_drake.errors import CdprError
from cdpr_drake.palette import TENSIONS, rgb
from cdpr_drake.studio.workbench.command_board import CommandBoard
from cdpr_drake.studio.workbench.command_form import FieldProblem, OptionKind
from cdpr_drake.studio.workbench.command_job import CommandJob
from cdpr_drake.studio.workbench.finished_studies import study_folder
from cdpr_drake.studio.workbench.job import JobState
from cdpr_drake.studio.workbench.job_manager import JobManager
from cdpr_drake.studio.workbench.working_folder import WorkingFolder
from cdpr_drake.studio.workspace import (
    PLANE,
    UNKNOWN,
    Plane,
    colors_of,
    draw_plane,
    read_regions,
    show_regions,
)


@pytest.fixture(scope="module")
def forms():
    return command_forms()


def test_a_form_has_every_option_of_its_command(forms, capsys):
    """The list of options is that of the command itself; a new option is in the form at once."""
    with pytest.raises(SystemExit):
        main(["workspace", "--help"])
    help_words = capsys.readouterr().out
    offered = {option.name for option in forms["workspace"].options}
    assert all(name in help_words for name in offered)
    options = {one.name for one in shown_arguments("workspace") if one.name.startswith("--")}
    assert offered == options - {f"--{name}" for name in LEFT_OUT}
    assert not {option.key for form in forms.values() for option in form.options} & LEFT_OUT
    assert forms["workspace"].option("rays").usual == "10000"
    assert forms["workspace"].option("velocity").many
    assert forms["study"].option("quick").kind == OptionKind.FLAG
    assert forms["stability"].option("figure-format").usual == "png"


def test_arguments_are_what_was_filled_in(forms, tmp_path):
    path_of = WorkingFolder(tmp_path).path
    filled = {
        "kind": "static", "measure": "payload", "certify": True, "force": " 2.5 ", "rays": "100",
        "velocity": "0,0,1; 0,0,2", "obstacles": "boxes.yaml", "grid": "",
    }  # fmt: skip
    assert forms["workspace"].arguments(filled, path_of) == [
        "--measure=payload", "--force=2.5", "--velocity=0,0,1", "--velocity=0,0,2",
        f"--obstacles={tmp_path.resolve() / 'boxes.yaml'}", "--rays=100", "--certify",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("key", "value"),
    [("force", "much"), ("force", "nan"), ("force", "1e999"), ("rays", "1.5"), ("rays", "9" * 5000),
     ("obstacles", "../secret.yaml"), ("obstacles", "/etc/passwd"), ("mesh", "a\0b"),
     ("grid", "1\n2")],
)  # fmt: skip
def test_a_wrong_value_is_refused_at_its_field(forms, tmp_path, key, value):
    with pytest.raises(FieldProblem) as problem:
        forms["workspace"].arguments({key: value}, WorkingFolder(tmp_path).path)
    assert problem.value.key == key
    assert len(problem.value.words) <= 500


def test_what_a_command_refuses_belongs_to_the_field_it_names(forms):
    form = forms["workspace"]
    assert form.field_of("--grid: found 'x'; accepted: numbers") == "grid"
    assert form.field_of("Invalid value for '--boxes': 0") == "boxes"
    assert form.field_of("the disk is full") == ""


def test_regions_have_the_volumes_that_the_command_printed(computed):
    regions = read_regions(computed)
    printed = (computed / "printed.txt").read_text()
    told = json.loads((computed / "results.json").read_text())["workspaces"]
    assert [layer.name for layer in regions.layers] == ["all", "static", "wrench-feasible"]
    for layer in regions.layers:
        assert layer.volume == told[layer.name]["corners_m3"]
        rows = [line.split() for line in printed.splitlines()]
        (row,) = [row for row in rows if row[:1] == [layer.name]]
        assert f"{layer.volume:.4g}" in row


def test_layers_and_a_plane_are_put_into_a_scene_and_taken_out(computed):
    regions, meshcat = read_regions(computed), open_meshcat()
    show_regions(meshcat, regions, {"static"})
    assert meshcat.HasPath("workspaces/static")
    assert meshcat.HasPath("workspaces/all")
    draw_plane(meshcat, regions, Plane("capacity-margin", 2, 1))
    assert meshcat.HasPath(PLANE)
    draw_plane(meshcat, regions, None)
    assert not meshcat.HasPath(PLANE)
    show_regions(meshcat, None, set())
    assert not meshcat.HasPath("workspaces")
    assert regions.normals() == [0, 1, 2]


def test_a_hull_and_proven_boxes_are_layers_too(tmp_path):
    folder = tmp_path / "proven"
    with pytest.raises(SystemExit):
        main(["workspace", "acrobot_small", "--grid", "3,3,3", "--kind", "static",
              "--hull", "0,0,0.3", "--rays", "100", "--certify", "--boxes", "400",
              "--out", str(folder), "--json"])  # fmt: skip
    told = json.loads((folder / "results.json").read_text())
    regions, meshcat = read_regions(folder), open_meshcat()
    layers = {layer.name: layer for layer in regions.layers}
    assert layers["hull"].volume == told["hull"]["volume_m3"]
    assert told["certified"]["outside_share"] == 0.0  # of so few boxes
    assert list(layers) == ["static", "hull", "boxes inside", "boxes open"]
    for name in ("inside", "open"):
        layer = layers[f"boxes {name}"]
        assert layer.share == told["certified"][f"{name}_share"]
        corners = layer.solid[0].reshape(-1, 8, 3)
        volume = np.prod(np.ptp(corners, axis=1), axis=1).sum()
        assert volume == pytest.approx(layer.volume, rel=1e-9)
    show_regions(meshcat, regions, {"boxes open"})
    assert meshcat.HasPath("workspaces/hull")
    assert meshcat.HasPath("workspaces/boxes open")
    (folder / "boxes.npz").write_bytes(b"")
    with pytest.raises(CdprError, match=r"boxes.npz: found no boxes"):
        read_regions(folder)


def test_colours_of_a_plane_go_from_the_least_to_the_largest_value():
    colors = colors_of(np.array([1.0, 3.0, 2.0, np.nan, -np.inf]), (1.0, 3.0))
    np.testing.assert_allclose(colors[0], rgb(TENSIONS[0]))
    np.testing.assert_allclose(colors[1], rgb(TENSIONS[-1]))
    np.testing.assert_allclose(colors[3:], [UNKNOWN, UNKNOWN])
    middle = (np.array(rgb(TENSIONS[3])) + rgb(TENSIONS[4])) / 2.0
    np.testing.assert_allclose(colors[2], middle)


@pytest.mark.parametrize(
    "words", ["", "[]", "{}", '{"workspaces": 3}', "\xff", '{"workspaces": {}}']
)
def test_broken_results_are_one_message(tmp_path, words):
    (tmp_path / "results.json").write_text(words, encoding="latin-1")
    with pytest.raises(CdprError):
        read_regions(tmp_path)


def test_a_study_has_verdicts_tables_and_figures(tmp_path):
    statement = {"words": "w", "printed": "1", "found": "2", "verdict": "confirmed", "why": ""}
    told = {
        "study": "some", "quick": True, "wall_time_s": 1.25, "versions": {"a": "b"},
        "statements": [statement, statement | {"verdict": "in part"}],
        "runs": [{"seed": k, "summary": {"no": 1}} for k in range(100)],
    }  # fmt: skip
    (tmp_path / "results.json").write_text(json.dumps(told))
    (tmp_path / "a.png").write_bytes(b"")
    (tmp_path / "outside.png").symlink_to("/etc/hostname")
    study = study_folder(tmp_path)
    assert study.verdicts() == {"confirmed": 1, "in part": 1}
    assert study.remarks() == "short form"
    columns, rows, count = study.tables["runs"]
    assert (columns, len(rows), count) == (["seed"], 60, 100)
    assert study.facts == {"study": "some", "quick": "yes", "wall_time_s": "1.25"}
    assert [figure.name for figure in study.figures] == ["a.png"]


STEADY = """
import pathlib, signal, sys, time
folder = pathlib.Path(next(a for a in sys.argv if a.startswith("--out="))[6:])
folder.mkdir(parents=True, exist_ok=True)
def stop(*_):
    (folder / "kept").write_text("half")
    sys.exit(130)
signal.signal(signal.SIGTERM, stop)
print("progress: some: 50 %, half of it", file=sys.stderr, flush=True)
if (folder / "kept").exists():
    (folder / "results.json").write_text("{}")
    sys.exit(0)
time.sleep(3600)
"""


def test_stop_keeps_what_is_finished_and_continue_goes_on_in_the_same_folder(
    tmp_path, monkeypatch, forms
):
    monkeypatch.setattr(CommandJob, "program", (sys.executable, "-c", STEADY))
    jobs = JobManager()
    board = CommandBoard(jobs, tmp_path, "workspaces", forms)
    first = board.start("some", ["workspace", "acrobot_small"])
    try:
        while first.progress[0] is None and not first.state.is_over:  # it listens to SIGTERM then
            first.wait(0.05)
        assert first.progress == (0.5, "some: half of it")
        assert board.go_on(board.choices()["some"]) is None  # it works
        first.stop()
        assert first.wait(1200.0)
        assert first.state == JobState.STOPPED
        assert not board.choices()["some"].is_whole
        board = CommandBoard(jobs, tmp_path, "workspaces", forms)
        assert board.choices()["some"].job is first
        jobs.close()
        jobs = JobManager()  # as when the server was started anew
        board = CommandBoard(jobs, tmp_path, "workspaces", forms)
        there = board.choices()["some"]
        assert (there.name, there.job, there.is_whole) == ("some, stopped", None, False)
        second = board.go_on(there)
        assert second.wait(1200.0)
        assert second.state == JobState.FINISHED
        assert (second.arguments, second.folder) == (first.arguments, first.folder)
        assert board.choices()["some"].is_whole
        assert board.choices()["some"].asked == ()  # it is done
        assert [path.name for path in board.folder.iterdir()] == ["some"]
    finally:
        jobs.close()


@pytest.mark.parametrize(
    ("words", "runs"),
    [
        ('["workspace", "acrobot_small", "--kind=static", "--certify"]', True),
        ('["study", "case-9", "--quick"]', True),
        ('["workspace", "mine.yaml"]', True),
        ('["workspace", "/etc/hostname"]', False),
        ('["workspace", "acrobot_small", "--obstacles=../secret.yaml"]', False),
        ('["workspace", "acrobot_small", "--certify=yes"]', False),
        ('["study", "case-9", "--runs-from=/etc"]', False),
        ('["study", "case-9", "--out=/tmp"]', False),
        ('["simulate", "acrobot_pbvs"]', False),
        ('["study"]', False), ("{}", False), ("[1]", False), ("[", False),
    ],
)  # fmt: skip
def test_a_file_asks_for_no_more_than_a_page_would(tmp_path, forms, words, runs):
    (tmp_path / "studies" / "some").mkdir(parents=True)
    (tmp_path / "studies" / ".some.asked.json").write_text(words)
    jobs = JobManager()
    board = CommandBoard(jobs, tmp_path, "studies", forms)
    there = board.choices()["some"]
    assert bool(there.asked) == runs
    if not runs:
        assert board.go_on(there) is None
        assert jobs.jobs == []


def test_a_board_lists_finished_folders_the_newest_first_and_no_links(tmp_path):
    board = CommandBoard(JobManager(), tmp_path, "studies", {})
    assert board.choices() == {}
    for name in ("b", "a"):
        (tmp_path / "studies" / name).mkdir(parents=True)
    (tmp_path / "studies" / "a" / "results.json").write_text("{}")
    (tmp_path / "studies" / "link").symlink_to(tmp_path / "studies" / "a")
    assert list(board.choices()) == ["a"]


def test_workspaces_of_stability_are_layers_and_their_margin_a_plane(tmp_path):
    folder = tmp_path / "stable"
    with pytest.raises(SystemExit):
        main(["stability", "acrobot_small", "--verdict", "sampled", "--draws", "2", "--grid",
              "3,3,3", "--out", str(folder), "--json"])  # fmt: skip
    (told,) = json.loads((folder / "results.json").read_text())["workspaces"]
    regions, meshcat = read_regions(folder), open_meshcat()
    assert [layer.name for layer in regions.layers] == ["baseline SZ", "baseline Z", "baseline S"]
    for layer in regions.layers:
        assert layer.volume == told[layer.name.split()[1]]["corners_m3"]
    (name,) = regions.values
    assert regions.values[name].shape == (3, 3, 3)
    draw_plane(meshcat, regions, Plane(name, 0, 2))
    assert meshcat.HasPath(PLANE)
