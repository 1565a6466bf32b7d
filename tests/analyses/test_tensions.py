"""`solve_tensions` and `cdpr tension`: published numbers, methods, verdicts, figures."""

import json

import numpy as np
import pytest

import cdpr_drake as cdpr
from cdpr_drake.analyses.tension_figures import polygon_figure
from cdpr_drake.analyses.tensions import applicable_methods, polygon_tensions
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.models.robot_statics import tension_problem, wrench_balance
from cdpr_drake.tensions import methods
from cdpr_drake.tensions.methods import METHODS, distribute
from tests.analyses.verbs.verb_checks import one_line, shows_itself
from tests.cli.commands import answer, told
from tests.figure_faults import figure_faults

PRINTED = [2.08, 2.08, 2.43, 2.58, 3.74, 4.30, 12.76, 13.31]
"""Tensions at `POSE`, servoing thesis 1.3.4 [N]."""

PRINT_ROUNDING = 0.005
"""The thesis prints two decimals."""

POSE, HOPELESS = [0.35, -0.27, 0.45], [0.5, 0.5, 1.1]
"""Of ACROBOT: one that many tensions hold, and one that none hold [m]."""


def test_the_command_prints_the_published_tensions(capsys, tmp_path):
    """The thesis has fixed exit points; over the pulleys of 4.5 mm they are up to 0.1 N off."""
    plot = tmp_path / "polygon.png"
    line = "tension acrobot_large --pose 0.35,-0.27,0.45 --method barycenter --limits 0,60"
    result = told(capsys, *line.split(), "--no-pulleys", "--plot", plot)
    assert result["status"] == "feasible"
    np.testing.assert_allclose(result["tensions_n"], PRINTED, atol=PRINT_ROUNDING)
    assert len(result["polygon_vertices_n"]) >= 3
    assert plot.stat().st_size > 10_000


def test_arguments_are_those_of_the_problem(planar, aside):
    push = np.array([0.0, 0.0, 0.1, 2.0, 0.0, 0.0])
    problem = tension_problem(planar, aside.transform(), push)
    result = cdpr.solve_tensions(planar, aside, push, "infinity_norm")
    expected = distribute(problem, "infinity_norm")
    assert result.as_dict() == {
        "robot": "planar", "geometry": "with pulleys of 4.5 mm", "redundancy": 1,
        "rows": ["moment about z", "force along x", "force along y"],
        "wrench_n_m_n": problem.wrench.tolist(), "infeasible_by": None, **expected.as_dict(),
    }  # fmt: skip
    assert "feasible" in shows_itself(result)
    more = {"limits": (2.0, 30.0), "length_scale": 0.1, "mass": 2.0}
    relaxed = cdpr.solve_tensions(planar, aside, push, "slack_relaxed", **more)
    problem = tension_problem(planar, aside.transform(), push, **more)
    assert relaxed.solution.as_dict() == distribute(problem, "slack_relaxed").as_dict()
    desired = cdpr.solve_tensions(planar, method="reference_program", reference=6.0)
    assert np.max(np.abs(desired.tensions - 6.0)) < 1.0
    one_line(lambda: cdpr.solve_tensions(planar, method="dijkstra"), "dijkstra", "dykstra")


def test_all_methods_are_those_that_take_the_redundancy(planar):
    large = cdpr.solve_tensions("acrobot_large", POSE, method="all")
    names = [solution.method for solution in large.solutions]
    assert names == applicable_methods(large.problem)
    assert set(METHODS) - set(names) == {"kernel", "reference_program"}
    for corner in polygon_tensions(large.problem):
        assert large.problem.residual(np.array(corner)) < 1e-12
    flat = cdpr.solve_tensions(planar, method="all")
    assert [solution.method for solution in flat.solutions] == [
        name for name, method in METHODS.items() if method.takes(1) and not method.needs_reference
    ]
    shows_itself(flat)


def test_an_infeasible_pose_is_an_answer_without_nan(capsys):
    result = cdpr.solve_tensions("acrobot_large", HOPELESS, method="all")
    for row in result.as_dict()["solutions"]:
        assert row["status"] == "infeasible"
        json.dumps(row, allow_nan=False)
        assert (row["tensions_n"] is None) == (not METHODS[row["method"]].answers)
    assert told(capsys, "tension", "acrobot_large", "--pose", "0.5,0.5,1.1")["status"] == (
        "infeasible"
    )


def test_fewer_cables_than_degrees_of_freedom(capsys):
    robot = cdpr.load_robot("grab_three")
    result = cdpr.solve_tensions(robot)
    control = wrench_balance(robot, robot.home.transform()).control()
    assert result.tensions.shape == (3,)
    json_of = result.as_dict()
    assert json_of["geometry"] == "with pulleys of 25 mm"
    assert json_of["rank"] == control.rank
    assert [row["unbalanced"] for row in json_of["uncontrolled"]] == control.unbalanced.tolist()
    assert "no tensions change" in shows_itself(result)
    one_line(lambda: cdpr.solve_tensions(robot, method="dykstra"), "quadratic_program")


def methods_in(figure):
    words = " ".join(text.get_text() for text in figure.legends[0].get_texts()).split()
    return sorted(word for word in words if word in METHODS)


@pytest.mark.parametrize("method", ["barycenter", "all"])
def test_the_polygon_names_every_method_that_was_asked_for_once(monkeypatch, method):
    """One of a single method once ran, and compiled, all of them."""
    result, compiled = cdpr.solve_tensions("acrobot_large", POSE, method=method), []
    monkeypatch.setattr(methods, "kernel_address", compiled.append)
    figure = result.plot("polygon")
    assert figure_faults(figure) == []
    (axes,) = figure.axes
    assert compiled == []
    assert methods_in(figure) == sorted(solution.method for solution in result.solutions)
    markers = [line.get_marker() for line in axes.lines if line.get_linestyle() == "None"]
    assert len(set(markers)) == len(markers)  # grey print has no colours
    assert "[N]" in axes.get_xlabel()


def test_figures(planar):
    hopeless = cdpr.solve_tensions("acrobot_large", HOPELESS)
    assert list(hopeless.figures()) == ["tensions", "wrenches"]
    with pytest.raises(TensionProblemError, match="found none to draw"):
        polygon_figure(hopeless.problem, [], "title")
    flat = cdpr.solve_tensions(planar, method="all")
    for name in flat.figures():
        assert figure_faults(flat.plot(name)) == []


def test_a_mechanism_is_answered_in_the_same_words(capsys, tmp_path):
    words = ("tension", "cable_arm", "--method", "closed_form")
    result = cdpr.solve_tensions("cable_arm", method="closed_form")
    assert told(capsys, *words) == json.loads(json.dumps(result.as_dict()))
    loose = ("tension", "arm_on_platform", "--held", "none", "--plot", tmp_path / "a.png")
    said = answer(capsys, *loose)
    assert "8 cables control 6 of 8 rows" in said
    assert "moment at arm_on_platform::shoulder" in said
    assert (tmp_path / "a.png").stat().st_size > 1000
