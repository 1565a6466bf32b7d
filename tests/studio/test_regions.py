"""Workspaces that commands left, as layers and planes of a scene: without a page."""

import json

import numpy as np
import pytest

from cdpr_drake.analyses.visualization.meshcat_window import open_meshcat
from cdpr_drake.cli.app import main
from cdpr_drake.errors import CdprError
from cdpr_drake.palette import TENSIONS, rgb
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
def meshcat():
    return open_meshcat()


def computed_regions(folder, *words):
    """What a command leaves in a folder, and its regions."""
    with pytest.raises(SystemExit):
        main([*words, "--grid=3,3,3", f"--out={folder}", "--json"])
    return json.loads((folder / "results.json").read_text()), read_regions(folder)


def test_regions_have_the_volumes_that_the_command_printed(computed):
    rows = [line.split() for line in (computed / "printed.txt").read_text().splitlines()]
    layers = read_regions(computed).layers
    assert [layer.name for layer in layers] == ["all", "static", "wrench-feasible"]
    for layer in layers:
        (row,) = [row for row in rows if row[:1] == [layer.name]]
        assert [layer.share.split()[0], layer.volume.split()[0]] == row[2:4]


def test_layers_and_a_plane_are_put_into_a_scene_and_taken_out(computed, meshcat):
    regions = read_regions(computed)
    assert regions.normals() == [0, 1, 2]
    show_regions(meshcat, regions, {"static"})
    assert meshcat.HasPath("workspaces/static")
    assert meshcat.HasPath("workspaces/all")
    draw_plane(meshcat, regions, Plane("capacity-margin", 2, 1))
    assert meshcat.HasPath(PLANE)
    draw_plane(meshcat, regions, None)
    assert not meshcat.HasPath(PLANE)
    show_regions(meshcat, None, set())
    assert not meshcat.HasPath("workspaces")


def test_a_hull_and_proven_boxes_are_layers_too(tmp_path, meshcat):
    told, regions = computed_regions(
        tmp_path / "proven", "workspace", "acrobot_small", "--kind=static", "--hull=0,0,0.3",
        "--rays=100", "--certify", "--boxes=400",
    )  # fmt: skip
    layers = {layer.name: layer for layer in regions.layers}
    assert list(layers) == ["static", "hull", "boxes inside", "boxes open"]
    assert layers["hull"].volume == f"{told['hull']['volume_m3']:.4g} m^3"
    assert told["certified"]["outside_share"] == 0.0  # of so few boxes
    for name in ("inside", "open"):
        layer = layers[f"boxes {name}"]
        assert layer.share == f"{100.0 * told['certified'][f'{name}_share']:.2f} %"
        corners = layer.solid[0].reshape(-1, 8, 3)
        volume = np.prod(np.ptp(corners, axis=1), axis=1).sum()
        assert layer.volume == f"{volume:.4g} m^3"
    show_regions(meshcat, regions, {"boxes open"})
    assert meshcat.HasPath("workspaces/hull")
    assert meshcat.HasPath("workspaces/boxes open")
    (tmp_path / "proven" / "boxes.npz").write_bytes(b"")
    with pytest.raises(CdprError, match=r"boxes.npz: found no boxes"):
        read_regions(tmp_path / "proven")


def test_workspaces_of_stability_are_layers_and_their_margin_a_plane(tmp_path, meshcat):
    told, regions = computed_regions(
        tmp_path / "stable", "stability", "acrobot_small", "--verdict=sampled", "--draws=2"
    )
    (volumes,) = told["workspaces"]
    assert [(layer.name, layer.volume) for layer in regions.layers] == [
        (f"baseline {name}", f"{volumes[name]['corners_m3']:.4g} m^3") for name in ("SZ", "Z", "S")
    ]
    ((name, values),) = regions.values.items()
    assert values.shape == (3, 3, 3)
    draw_plane(meshcat, regions, Plane(name, 0, 2))
    assert meshcat.HasPath(PLANE)


def test_colours_of_a_plane_go_from_the_least_to_the_largest_value():
    colors = colors_of(np.array([1.0, 3.0, 2.0, np.nan, -np.inf]), (1.0, 3.0))
    middle = (np.array(rgb(TENSIONS[3])) + rgb(TENSIONS[4])) / 2.0
    expected = [rgb(TENSIONS[0]), rgb(TENSIONS[-1]), middle, UNKNOWN, UNKNOWN]
    np.testing.assert_allclose(colors, expected)


@pytest.mark.parametrize("words", ["{}", '{"workspaces": 3}', '{"workspaces": []}'])
def test_results_of_something_else_are_refused(tmp_path, words):
    (tmp_path / "results.json").write_text(words)
    with pytest.raises(CdprError, match="found no stored workspace"):
        read_regions(tmp_path)
