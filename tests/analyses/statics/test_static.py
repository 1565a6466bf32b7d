"""`solve_static` and `cdpr static`: poses and lengths that agree, output, figures, refusals."""

import json
from dataclasses import replace

import numpy as np
import pytest

import cdpr_drake as cdpr
from cdpr_drake.analyses.statics.robot_at_rest import static_at_lengths, static_at_pose
from cdpr_drake.cables.states import cable_state
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from tests.analyses.verbs.verb_checks import as_json, one_line, shows_itself
from tests.cli.commands import answer, told
from tests.figure_faults import figure_faults

X_WP = pose_from_angles([0.1, 0.05, 0.4], [0.0, 0.0, 0.1])
ROBOT = load_robot("acrobot_large")


@pytest.mark.parametrize("pulleys", [False, True])
@pytest.mark.parametrize("model", ["elastic", "catenary"])
def test_lengths_of_a_pose_lead_back_to_it(model, pulleys):
    held = static_at_pose(ROBOT, X_WP, model, pulleys)
    back = static_at_lengths(ROBOT, held.l0, model, pulleys)
    assert pose_error(back.X_WP, X_WP) < (1e-9, 1e-8)
    np.testing.assert_allclose(back.tensions, held.tensions, rtol=1e-4)
    np.testing.assert_allclose(back.frequencies, held.frequencies, rtol=1e-6)
    assert back.others  # it could hang upside down, too
    assert held.stability == back.stability == "stable"
    assert held.cables.has_pulleys() == pulleys


def test_inextensible_cables_are_rigid():
    held = static_at_pose(ROBOT, X_WP, "inextensible", True)
    assert held.frequencies is None
    assert np.all(np.isinf(held.principal))
    back = static_at_lengths(ROBOT, held.l0, "inextensible", True)
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
    lengths = cdpr.solve_static(robot).l0
    cdpr.solve_static(robot, lengths=lengths * (1.0 - 1e-4))
    with pytest.raises(CdprError, match="at most its breaking load, 100 N"):
        cdpr.solve_static(robot, lengths=lengths * (1.0 - 1e-3))


@pytest.mark.parametrize("model", ["elastic", "catenary", "inextensible"])
def test_the_figure_of_a_rest_shows_modes_where_there_are_some(model):
    figure = cdpr.solve_static("planar", model=model).plot()
    assert figure_faults(figure) == []
    side, above, tensions, *modes = figure.axes
    assert len(modes) == (model != "inextensible")  # those have no vibrations, and no panel
    assert side.get_xlabel() == "x in W [m]"
    assert above.get_ylabel() == "y in W [m]"
    assert len(tensions.patches) == 4


def test_sags_are_those_of_a_parabola(capsys):
    line = "static caroca --pose 0.3,0.5,1.2,0,0,5 --cable-model catenary"
    result = told(capsys, *line.split())
    assert set(result) == {
        "robot", "cable_model", "pulleys", "geometry", "pose", "unstrained_lengths_m", "lengths_m",
        "tensions_n", "slack", "surplus_lengths_m", "sags_m", "stability",
        "principal_stiffnesses_n_per_m", "stiffness", "frequencies_hz", "modes", "other_equilibria",
    }  # fmt: skip
    assert result["pose"]["angles_deg"] == pytest.approx([0.0, 0.0, 5.0])
    sags = np.array(result["sags_m"])
    assert np.all((sags > 0.004) & (sags < 0.03))
    # w l^2 / (8 t) for cables of 4 m, 0.222 kg/m and about 350 N.
    lengths, tensions = np.array(result["lengths_m"]), np.array(result["tensions_n"])
    slope = 0.75  # of the span's horizontal part
    parabola = slope * 0.222 * 9.81 * lengths**2 / 8 / tensions
    np.testing.assert_allclose(sags, parabola, rtol=0.35)


def test_verb_and_command_answer_alike(capsys, planar, aside, tmp_path):
    held = cdpr.solve_static(planar, aside)
    assert as_json(held) == as_json(static_at_pose(planar, aside.transform(), "elastic", True))
    assert "stable" in shows_itself(held)
    hanging = cdpr.solve_static(planar, lengths=list(held.l0))
    assert hanging.as_dict() == static_at_lengths(planar, held.l0, "elastic", True).as_dict()
    assert told(capsys, "static", "acrobot_large") == as_json(cdpr.solve_static("acrobot_large"))
    plot = tmp_path / "rest.png"
    words = ("--lengths", ",".join(["1.2"] * 8), "--no-pulleys", "--plot", plot)
    out = answer(capsys, "static", "acrobot_large", *words)
    for words in ("pulleys ignored", "natural frequencies [Hz]", "other poses of rest"):
        assert words in out
    assert plot.stat().st_size > 10_000


def test_a_mechanism_has_options_of_its_own(capsys):
    words = ("static", "arm_on_platform", "--joint", "shoulder=0.1", "--prestress", "10")
    result = cdpr.solve_static("arm_on_platform", joints={"shoulder": 0.1}, prestress=10.0)
    assert told(capsys, *words) == as_json(result)
    said = answer(capsys, *words)
    assert "arm_on_platform at rest: stable" in said
    assert "arm_on_platform::shoulder is held with" in said
    assert cdpr.solve_static("arm_on_platform", held=()).held() == {}
    yielding = told(capsys, "static", "cable_arm", "--yields", "pose", "--prestress", "40")
    np.testing.assert_allclose(yielding["tensions_n"], 40.0, atol=1e-3)
    again = cdpr.solve_static("cable_arm", lengths=yielding["unstrained_lengths_m"])
    np.testing.assert_allclose(again.rest.tensions, 40.0, atol=0.1)
    free = told(capsys, "static", "cable_arm", "--free", "elbow", "--limits", "5,200")
    assert min(free["tensions_n"]) >= 5.0
    assert free["positions"]["cable_arm::shoulder"] == [0.2]
    assert figure_faults(result.plot()) == []


def test_refusals_of_a_call(planar, aside):
    one_line(lambda: cdpr.solve_static(planar, aside, [1.0] * 4), "both")
    one_line(lambda: cdpr.solve_static(planar, lengths=[1.0, 1.0]), "shape (2,)")
    one_line(lambda: cdpr.solve_static(planar, model="rubber"), "rubber")
