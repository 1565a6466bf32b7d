"""`cdpr workspace`: what bounds a hull, whether cables run over pulleys, by which method."""

import json

import numpy as np
import pytest

from cdpr_drake.analyses.workspaces.static_feasible import static_case
from cdpr_drake.analyses.workspaces.workspace_results import load_robot_workspace
from cdpr_drake.cli.app import main
from cdpr_drake.models.robot_exchange import import_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.workspaces.static_feasibility import statically_feasible
from tests.messages import printed
from tests.models.formats import foreign_files


def ended(arguments):
    with pytest.raises(SystemExit) as end:
        main(arguments)
    return end.value.code


def test_pulleys_are_in_grid_and_proof_and_said_first(tmp_path, capsys):
    """They were left out, grid and boxes, and nothing said so."""
    told, holds = {}, {}
    for more in ((), ("--no-pulleys",)):
        out = tmp_path / f"pulleys{len(more)}"
        asked = ["workspace", "caroca", "--grid", "9,9,5", "--workers", "1", "--certify", "--boxes"]
        asked += ["1500", "--limits", "30,10000", "--out", str(out), "--json", *more]
        assert ended(asked) == 0
        said = printed(capsys)
        found = json.loads(said.out)
        told[more], holds[more] = found, load_robot_workspace(out).holds["static"]
        assert next(iter(found)) == "cables"
        assert f"caroca: {found['geometry']}" in said.err
        assert found["agreement"]["grid"]["contradictions"] == 0
        assert found["agreement"]["grid"]["in_boxes_proven_inside"] > 0
        page = (out / "workspace.html").read_text()
        assert f"caroca: workspaces, {found['geometry']}" in page
    assert [one["cables"] for one in told.values()] == [
        "over pulleys", "without pulleys: from fixed exit points",
    ]  # fmt: skip
    assert [one["geometry"] for one in told.values()] == [
        "with pulleys of 75 mm", "pulleys ignored",
    ]  # fmt: skip
    assert [one["certified"]["cables"] for one in told.values()] == [
        "over pulleys", "from fixed exit points",
    ]  # fmt: skip
    robot = load_robot("caroca")
    case = static_case(robot, (30.0, 10_000.0), pulleys=True)
    grid = load_robot_workspace(tmp_path / "pulleys0").grid
    np.testing.assert_array_equal(
        holds[()].ravel(), statically_feasible(case, grid.positions(), grid.rotations())
    )
    assert np.any(holds[()] != holds["--no-pulleys",])


def test_an_assumed_frame_bounds_no_hull(tmp_path, capsys):
    """Of an imported robot it was the box of the exit points, and rays ended there."""
    source = tmp_path / "toy"
    source.mkdir()
    imported = import_robot(foreign_files.wirex(source))
    path = tmp_path / "toy.yaml"
    path.write_text(imported.yaml())
    robot = load_robot(str(path))
    assert robot.frame.assumed
    given = path.read_text().replace("  assumed: true\n", "")
    (tmp_path / "given.yaml").write_text(given)
    center = ",".join(f"{x:g}" for x in robot.home.position)
    told = {}
    small = robot.home.position[:, np.newaxis] + 0.1 * np.array([-1.0, 1.0])
    box = ",".join(f"{low:.6f}:{high:.6f}" for low, high in small)
    for name, file, more in (
        ("assumed", "toy.yaml", []),
        ("given", "given.yaml", []),
        ("unbounded", "given.yaml", ["--unbounded"]),
        ("box", "toy.yaml", ["--box", box]),
    ):
        asked = ["workspace", str(tmp_path / file), "--grid", "3,3,3", "--workers", "1", "--hull"]
        asked += [center, "--rays", "100", "--limits", "0,5000", "--mass", "0.1", "--json"]
        asked += ["--out", str(tmp_path / name), *more]
        assert ended(asked) == 0
        said = printed(capsys)
        told[name] = json.loads(said.out)["hull"]
        assert ("frame was assumed" in said.err) == (name == "assumed")
    assert [one["bounded_by"] for one in told.values()] == ["nothing", "frame", "nothing", "box"]
    assert told["assumed"]["volume_m3"] == told["unbounded"]["volume_m3"]
    assert told["assumed"]["volume_m3"] > 1.01 * told["given"]["volume_m3"]
    assert told["given"]["rays_to_the_bound"] > 0
    assert told["box"]["volume_m3"] == pytest.approx(0.2**3, rel=0.2)
    beyond = ["workspace", str(path), "--grid", "2,2,2", "--box", "9:10,9:10,9:10", "--json"]
    assert ended([*beyond, "--workers", "1", "--out", str(tmp_path / "beyond")]) == 0
    assert json.loads(printed(capsys).out)["workspaces"]["static"]["poses"] == 0
    grid = load_robot_workspace(tmp_path / "box").grid
    for axis, (low, high) in zip(grid.axes, small, strict=True):
        np.testing.assert_allclose(axis[[0, -1]], (low, high), atol=1e-5)


def test_a_method_that_misses_tensions_has_a_smaller_workspace(tmp_path, capsys):
    shares = {}
    for method in (None, "quadratic_program", "closed_form"):
        more = [] if method is None else ["--method", method]
        asked = ["workspace", "acrobot_large", "--grid", "9,9,5", "--workers", "1", "--json"]
        assert ended([*asked, "--out", str(tmp_path / f"{method}"), *more]) == 0
        told = json.loads(printed(capsys).out)
        assert told["method"] == method
        shares[method] = told["workspaces"]["static"]["pose_share"]
    assert shares[None] == shares["quadratic_program"] > shares["closed_form"] > 0.0
