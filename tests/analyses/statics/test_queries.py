"""`cdpr static` and `cdpr tension`: answers that agree, pictures, and bad input in one line."""

import json
from dataclasses import replace

import numpy as np
import pytest

import cdpr_drake as cdpr
from cdpr_drake.analyses.statics.static_figures import polygon_figure, static_figure
from cdpr_drake.analyses.statics.static_query import static_at_lengths, static_at_pose
from cdpr_drake.analyses.statics.tension_query import (
    applicable_methods,
    polygon_tensions,
    solve_all,
)
from cdpr_drake.cables.models import cable_state
from cdpr_drake.cli.app import main
from cdpr_drake.errors import CdprError, TensionProblemError
from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform, tension_problem
from cdpr_drake.tensions import methods
from cdpr_drake.tensions.methods import METHODS
from tests.figure_faults import figure_faults
from tests.messages import printed

X_WP = pose_from_angles([0.1, 0.05, 0.4], [0.0, 0.0, 0.1])
ROBOT = load_robot("acrobot_large")

PRINTED = [2.08, 2.08, 2.43, 2.58, 3.74, 4.30, 12.76, 13.31]
"""Tensions at (0.35, -0.27, 0.45), servoing thesis 1.3.4 [N]."""

PRINT_ROUNDING = 0.005
"""The thesis prints two decimals."""


def call(capsys, arguments):
    """Code, output and messages of a command."""
    with pytest.raises(SystemExit) as stop:
        main(arguments.split())
    return stop.value.code, *printed(capsys)


@pytest.mark.parametrize("pulleys", [False, True])
@pytest.mark.parametrize("model", ["elastic", "catenary"])
def test_lengths_of_a_pose_lead_back_to_it(model, pulleys):
    there = static_at_pose(ROBOT, X_WP, model, pulleys)
    back = static_at_lengths(ROBOT, there.l0, model, pulleys)
    assert pose_error(back.X_WP, X_WP) < (1e-9, 1e-8)
    np.testing.assert_allclose(back.tensions, there.tensions, rtol=1e-4)
    np.testing.assert_allclose(back.frequencies, there.frequencies, rtol=1e-6)
    assert back.others  # it could hang upside down, too
    assert there.stability == back.stability == "stable"
    assert there.cables.has_pulleys() == pulleys


def test_inextensible_cables_are_rigid():
    there = static_at_pose(ROBOT, X_WP, "inextensible", True)
    assert there.frequencies is None
    assert np.all(np.isinf(there.principal))
    back = static_at_lengths(ROBOT, there.l0, "inextensible", True)
    assert pose_error(back.X_WP, X_WP) < (1e-6, 1e-6)
    assert np.sum(back.tensions > 0.0) <= 6
    json.dumps(back.as_dict(), allow_nan=False)


@pytest.mark.parametrize(
    ("height", "taut", "soft"),
    [pytest.param(0.005, 4, 2, id="as fitted"), pytest.param(0.035, 5, 1, id="middle of the box")],
)
def test_few_taut_cables_leave_soft_motions(height, taut, soft):
    """Eight equal lengths: cables are slack, and gravity alone holds a motion, or two where the
    centre of mass is low."""
    platform = replace(ROBOT.platform, center_of_mass=np.array([0.0, 0.0, height]))
    robot = replace(ROBOT, platform=platform)
    elastic, rigid = (
        static_at_lengths(robot, np.full(8, 1.2), model, True)
        for model in ("elastic", "inextensible")
    )
    assert np.sum(elastic.tensions > 0.0) == np.sum(rigid.tensions > 0.0) == taut
    assert elastic.principal[soft - 1] < 1e-3 * elastic.principal[soft]
    assert np.sum(np.isfinite(rigid.principal)) == soft
    np.testing.assert_allclose(rigid.principal[:soft], elastic.principal[:soft], rtol=0.01)
    assert elastic.frequencies[soft - 1] < 0.02 * elastic.frequencies[soft]
    wrench = cable_state(elastic.cables, "elastic", elastic.X_WP, elastic.l0).wrench
    wrench = wrench + rigid_platform(robot).weight_wrench(elastic.X_WP)
    np.testing.assert_allclose(wrench, 0.0, atol=1e-6)


def test_a_cable_holds_its_own_breaking_load():
    robot = load_robot("planar")
    robot = replace(robot, cable=replace(robot.cable, breaking_load=100.0))
    lengths = static_at_pose(robot, robot.home.transform(), "elastic", True).l0
    static_at_lengths(robot, lengths * (1.0 - 1e-4), "elastic", True)
    with pytest.raises(CdprError, match="at most its breaking load, 100 N"):
        static_at_lengths(robot, lengths * (1.0 - 1e-3), "elastic", True)


@pytest.mark.parametrize("model", ["elastic", "catenary", "inextensible"])
def test_the_figure_of_a_rest_shows_modes_where_there_are_some(model):
    robot = load_robot("planar")
    figure = static_figure(static_at_pose(robot, robot.home.transform(), model, True), "title")
    assert figure_faults(figure) == []
    side, above, tensions, *modes = figure.axes
    assert len(modes) == (model != "inextensible")  # those have no vibrations, and no panel
    assert side.get_xlabel() == "x in W [m]"
    assert above.get_ylabel() == "y in W [m]"
    assert len(tensions.patches) == 4


def test_the_command_prints_a_rest_as_json(capsys):
    pose = "--pose 0.3,0.5,1.2,0,0,5"
    code, out, _ = call(capsys, f"static caroca {pose} --cable-model catenary --json")
    found = json.loads(out)
    assert code == 0
    assert set(found) == {
        "robot", "cable_model", "pulleys", "geometry", "pose", "unstrained_lengths_m", "lengths_m",
        "tensions_n", "slack", "surplus_lengths_m", "sags_m", "stability",
        "principal_stiffnesses_n_per_m", "stiffness", "frequencies_hz", "modes", "other_equilibria",
    }  # fmt: skip
    assert found["pose"]["angles_deg"] == pytest.approx([0.0, 0.0, 5.0])
    assert min(found["sags_m"]) > 0.004
    assert max(found["sags_m"]) < 0.03
    # The parabola's w l^2 / (8 t) for cables of 4 m, 0.222 kg/m and about 350 N.
    parabola = 0.222 * 9.81 * np.array(found["lengths_m"]) ** 2 / 8 / np.array(found["tensions_n"])
    slope = 0.75  # of the span's horizontal part
    np.testing.assert_allclose(found["sags_m"], parabola * slope, rtol=0.35)


def test_the_command_prints_a_rest_as_a_table_and_draws_it(capsys, tmp_path):
    lengths, plot = ",".join(["1.2"] * 8), tmp_path / "rest.png"
    code, out, _ = call(
        capsys, f"static acrobot_large --lengths {lengths} --no-pulleys --plot {plot}"
    )
    assert code == 0
    for words in ("pulleys ignored", "natural frequencies [Hz]", "other poses of rest"):
        assert words in out
    assert plot.stat().st_size > 10_000


def test_without_a_pose_it_is_the_home_pose(capsys):
    code, out, _ = call(capsys, "static acrobot_large --json")
    assert code == 0
    home = ROBOT.home.transform().translation()
    assert json.loads(out)["pose"]["position_m"] == pytest.approx(home)


def test_a_file_of_nonsense_is_named_first(capsys, tmp_path):
    path = tmp_path / "nonsense.yaml"
    path.write_text("nonsense\n")
    code, _, err = call(capsys, f"static {path}")
    assert code == 2
    assert "nonsense.yaml" in err
    assert "--pose" not in err


@pytest.fixture
def problem():
    return tension_problem(ROBOT, pose_from_angles([0.35, -0.27, 0.45], np.zeros(3)))


@pytest.fixture
def hopeless():
    return tension_problem(ROBOT, pose_from_angles([0.5, 0.5, 1.1], np.zeros(3)))


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


def methods_in(axes):
    words = " ".join(text.get_text() for text in axes.get_legend().get_texts()).split()
    return sorted(word for word in words if word in METHODS)


def test_the_picture_names_every_method_once(problem, hopeless):
    figure = polygon_figure(problem, solve_all(problem), "title")
    assert figure_faults(figure) == []
    (axes,) = figure.axes
    markers = [line.get_marker() for line in axes.lines if line.get_linestyle() == "None"]
    assert len(set(markers)) == len(markers) > 5  # grey print has no colours
    assert methods_in(axes) == sorted(applicable_methods(problem))
    assert "[N]" in axes.get_xlabel()
    with pytest.raises(TensionProblemError, match="found none to draw"):
        polygon_figure(hopeless, [], "title")


@pytest.mark.parametrize(
    ("ask", "names"),
    [
        (lambda: cdpr.solve_tensions("acrobot_large", method="barycenter"), ["barycenter"]),
        (lambda: cdpr.compare_tensions("acrobot_large"), None),
    ],
)
def test_a_figure_has_the_methods_that_were_asked_for(monkeypatch, ask, names):
    """One of a single method once ran, and compiled, all of them."""
    found, asked = ask(), []
    monkeypatch.setattr(methods, "kernel_address", asked.append)
    (axes,) = found.plot().axes
    assert asked == []
    assert methods_in(axes) == sorted(names or applicable_methods(found.problem))


def test_the_command_prints_the_published_tensions(capsys, tmp_path):
    """The thesis has fixed exit points; over the pulleys of 4.5 mm they are up to 0.1 N off."""
    plot = tmp_path / "polygon.png"
    asked = "acrobot_large --pose 0.35,-0.27,0.45 --method barycenter --limits 0,60 --no-pulleys"
    code, out, _ = call(capsys, f"tension {asked} --json --plot {plot}")
    assert code == 0
    found = json.loads(out)
    assert found["status"] == "feasible"
    np.testing.assert_allclose(found["tensions_n"], PRINTED, atol=PRINT_ROUNDING)
    assert len(found["polygon_vertices_n"]) >= 3
    assert plot.stat().st_size > 10_000


def test_the_command_tells_infeasible_from_wrong_input(capsys):
    code, out, _ = call(capsys, "tension acrobot_large --pose 0.5,0.5,1.1 --json")
    assert code == 0
    assert json.loads(out)["status"] == "infeasible"
    code, out, _ = call(capsys, "tension planar --pose 0,0,0.3 --method all")
    assert code == 0
    assert "kernel" in out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("static acrobot_large --pose 0,0,0.4 --lengths 1,1,1,1,1,1,1,1", "found both"),
        ("static acrobot_large --pose 0,0", "--pose: found '0,0'"),
        ("static acrobot_large --lengths 1,1,1", "accepted: 8 lengths [m]"),
        ("static acrobot_large --lengths 1,1,1,1,1,1,1,-1", "lengths: found -1; accepted: > 0"),
        ("static acrobot_large --pose 0,0,5", "outside the frame"),
        ("static acrobot_large --pose 0.5,0.5,1.1", "reaches into the platform"),
        ("static acrobot_large --pose 0.5,0,0.5", "no tensions within 0..60 N"),
        ("static acrobot_large --pose 0,0,0.4 --cable-model rubber", "'rubber' is unknown"),
        ("static acrobot_large --lengths .2,.2,.2,.2,.2,.2,.2,.2", "is stretched by 5"),
        ("static acrobot_large --lengths 3,3,3,3,3,3,3,3", "outside the frame"),
        ("static planar --lengths .6,.6,.6,.6", "no pose in the frame has them"),
        ("static planar --lengths .713,.713,.713,.713 --cable-model inextensible", "mm longer"),
        ("tension acrobot_larg --pose 0,0,0.3", "did you mean"),
        ("tension acrobot_large --pose 0,0", "--pose: found '0,0'"),
        ("tension acrobot_large --pose 0,0,nan", "--pose: found '0,0,nan'"),
        ("tension acrobot_large --pose 0,0,9", "outside the frame"),
        ("tension acrobot_large --pose 0,0,0.3 --wrench 1,2", "--wrench"),
        ("tension acrobot_large --pose 0,0,0.3 --limits 5,2", "lower <= upper"),
        ("tension acrobot_large --pose 0,0,0.3 --limits=-5,2", ">= 0 [N]"),
        ("tension acrobot_large --pose 0,0,0.3 --mass=-1", "mass: found -1"),
        ("tension acrobot_large --pose 0,0,0.3 --method foo", "barycenter"),
        ("tension acrobot_large --pose 0,0,0.3 --method kernel", "redundancy m - n = 2"),
        ("tension acrobot_large --pose 0,0,0.3 --method reference_program", "no reference"),
        ("tension planar --pose 0,0,0.3 --plot x.png", "redundancy 1; accepted: 2"),
        ("tension acrobot_large --pose 0,0,0.3 --plot no/such/x.png", "cannot be written"),
    ],
)
def test_bad_input_ends_in_one_line_and_writes_nothing(
    capsys, tmp_path, monkeypatch, arguments, words
):
    monkeypatch.chdir(tmp_path)
    code, out, err = call(capsys, arguments)
    assert (code, out) == (2, "")
    assert words in err
    assert err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
