"""Forms of commands, and what commands left: without a page."""

import json

import numpy as np
import pytest

from cdpr_drake.analyses.visualization.meshcat_window import open_meshcat
from cdpr_drake.cli.app import main
from cdpr_drake.cli.call import shown_arguments
from cdpr_drake.cli.command_forms import LEFT_OUT, command_forms
from cdpr_drake.errors import CdprError
from cdpr_drake.palette import TENSIONS, rgb
from cdpr_drake.studio.folder import WorkingFolder
from cdpr_drake.studio.regions import (
    PLANE,
    UNKNOWN,
    Plane,
    colors_of,
    draw_plane,
    read_regions,
    show_regions,
)
from cdpr_drake.studio.workbench.command_form import FieldProblem, OptionKind


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
