"""The answers and the picture of `cdpr tension`."""

import json

import numpy as np
import pytest

import cdpr_drake as cdpr
from cdpr_drake.analyses.statics.static_figures import polygon_figure
from cdpr_drake.analyses.statics.tension_query import (
    applicable_methods,
    polygon_tensions,
    solve_all,
)
from cdpr_drake.cli.app import main
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.tensions import methods
from cdpr_drake.tensions.methods import METHODS
from tests.figure_faults import figure_faults
from tests.messages import printed

PRINTED = [2.08, 2.08, 2.43, 2.58, 3.74, 4.30, 12.76, 13.31]
"""Tensions at (0.35, -0.27, 0.45), servoing thesis 1.3.4 [N]."""

PRINT_ROUNDING = 0.005
"""The thesis prints two decimals."""


@pytest.fixture
def problem():
    robot = load_robot("acrobot_large")
    return tension_problem(robot, pose_from_angles([0.35, -0.27, 0.45], np.zeros(3)))


@pytest.fixture
def hopeless():
    robot = load_robot("acrobot_large")
    return tension_problem(robot, pose_from_angles([0.5, 0.5, 1.1], np.zeros(3)))


def test_methods_that_apply(problem):
    names = applicable_methods(problem)
    assert set(METHODS) - set(names) == {"kernel", "reference_program"}
    assert [s.method for s in solve_all(problem)] == names


def test_json_of_a_solution_has_no_nan(hopeless):
    for solution in solve_all(hopeless):
        found = solution.as_dict()
        assert found["status"] == "infeasible"
        json.dumps(found, allow_nan=False)
        assert (found["tensions_n"] is None) == (not METHODS[solution.method].answers)


def test_polygon_corners_balance_the_wrench(problem):
    for corner in polygon_tensions(problem):
        assert problem.residual(np.array(corner)) < 1e-12


def test_picture_names_every_method_once(problem):
    figure = polygon_figure(problem, solve_all(problem), "title")
    assert figure_faults(figure) == []
    (axes,) = figure.axes
    markers = [line.get_marker() for line in axes.lines if line.get_linestyle() == "None"]
    assert len(set(markers)) == len(markers) > 5  # grey print has no colours
    words = " ".join(text.get_text() for text in axes.get_legend().get_texts()).split()
    names = [word for word in words if word in METHODS]
    assert sorted(names) == sorted(applicable_methods(problem))
    assert "[N]" in axes.get_xlabel()


def test_no_picture_of_nothing(hopeless):
    with pytest.raises(TensionProblemError, match="found none to draw"):
        polygon_figure(hopeless, [], "title")


def command(capsys, *arguments):
    with pytest.raises(SystemExit) as ended:
        main(["tension", *arguments])
    out, err = printed(capsys)
    return ended.value.code, out, err


def test_command_prints_the_published_tensions(capsys, tmp_path):
    """The thesis has fixed exit points; over the pulleys of 4.5 mm they are up to 0.1 N off."""
    plot = tmp_path / "polygon.png"
    code, out, _ = command(
        capsys, "acrobot_large", "--pose", "0.35,-0.27,0.45", "--method", "barycenter",
        "--limits", "0,60", "--no-pulleys", "--json", "--plot", str(plot),
    )  # fmt: skip
    assert code == 0
    found = json.loads(out)
    assert found["status"] == "feasible"
    np.testing.assert_allclose(found["tensions_n"], PRINTED, atol=PRINT_ROUNDING)
    assert len(found["polygon_vertices_n"]) >= 3
    assert plot.stat().st_size > 10_000


def test_command_tells_infeasible_from_wrong_input(capsys):
    code, out, _ = command(capsys, "acrobot_large", "--pose", "0.5,0.5,1.1", "--json")
    assert code == 0
    assert json.loads(out)["status"] == "infeasible"
    code, out, _ = command(capsys, "planar", "--pose", "0,0,0.3", "--method", "all")
    assert code == 0
    assert "kernel" in out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["acrobot_larg", "--pose", "0,0,0.3"], "did you mean"),
        (["acrobot_large", "--pose", "0,0"], "--pose: found '0,0'"),
        (["acrobot_large", "--pose", "0,0,nan"], "--pose: found '0,0,nan'"),
        (["acrobot_large", "--pose", "0,0,9"], "outside the frame"),
        (["acrobot_large", "--pose", "0,0,0.3", "--wrench", "1,2"], "--wrench"),
        (["acrobot_large", "--pose", "0,0,0.3", "--limits", "5,2"], "lower <= upper"),
        (["acrobot_large", "--pose", "0,0,0.3", "--limits=-5,2"], ">= 0 [N]"),
        (["acrobot_large", "--pose", "0,0,0.3", "--mass=-1"], "mass: found -1"),
        (["acrobot_large", "--pose", "0,0,0.3", "--method", "foo"], "barycenter"),
        (["acrobot_large", "--pose", "0,0,0.3", "--method", "kernel"], "redundancy m - n = 2"),
        (["acrobot_large", "--pose", "0,0,0.3", "--method", "reference_program"], "no reference"),
        (["planar", "--pose", "0,0,0.3", "--plot", "x.png"], "redundancy 1; accepted: 2"),
        (["acrobot_large", "--pose", "0,0,0.3", "--plot", "no/such/x.png"], "cannot be written"),
    ],
)
def test_command_refuses(capsys, tmp_path, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    code, _, err = command(capsys, *arguments)
    assert code == 2
    assert words in err
    assert len(err.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("call", "names"),
    [
        (lambda: cdpr.solve_tensions("acrobot_large", method="barycenter"), ["barycenter"]),
        (lambda: cdpr.compare_tensions("acrobot_large"), None),
    ],
)
def test_a_figure_has_the_methods_that_were_asked_for(monkeypatch, call, names):
    """One of a single method once ran, and compiled, all of them."""
    found, asked = call(), []
    monkeypatch.setattr(methods, "kernel_address", asked.append)
    figure = found.plot()
    assert asked == []
    (axes,) = figure.axes
    words = " ".join(text.get_text() for text in axes.get_legend().get_texts()).split()
    shown = sorted(word for word in words if word in METHODS)
    assert shown == sorted(names or applicable_methods(found.problem))
