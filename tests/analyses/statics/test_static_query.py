"""`cdpr static`: its answers agree with each other, and bad input ends in one line."""

import json
from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.statics.static_query import static_at_lengths, static_at_pose
from cdpr_drake.cables.models import cable_state
from cdpr_drake.cli.app import main
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from tests.messages import printed

X_WP = pose_from_angles([0.1, 0.05, 0.4], [0.0, 0.0, 0.1])


def call(arguments, capsys):
    with pytest.raises(SystemExit) as stop:
        main(["static", *arguments.split()])
    out = printed(capsys)
    return stop.value.code, out.out, out.err


@pytest.mark.parametrize("pulleys", [False, True])
@pytest.mark.parametrize("model", ["elastic", "catenary"])
def test_lengths_of_a_pose_lead_back_to_it(model, pulleys):
    robot = load_robot("acrobot_large")
    there = static_at_pose(robot, X_WP, model, pulleys)
    back = static_at_lengths(robot, there.l0, model, pulleys)
    assert pose_error(back.X_WP, X_WP) < (1e-9, 1e-8)
    np.testing.assert_allclose(back.tensions, there.tensions, rtol=1e-4)
    np.testing.assert_allclose(back.frequencies, there.frequencies, rtol=1e-6)
    assert back.others  # it could hang upside down, too
    assert there.stability == back.stability == "stable"
    assert there.cables.has_pulleys() == pulleys


def test_inextensible_cables_are_rigid():
    robot = load_robot("acrobot_large")
    there = static_at_pose(robot, X_WP, "inextensible", True)
    assert there.frequencies is None
    assert np.all(np.isinf(there.principal))
    back = static_at_lengths(robot, there.l0, "inextensible", True)
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
    robot = load_robot("acrobot_large")
    platform = replace(robot.platform, center_of_mass=np.array([0.0, 0.0, height]))
    robot = replace(robot, platform=platform)
    elastic = static_at_lengths(robot, np.full(8, 1.2), "elastic", True)
    rigid = static_at_lengths(robot, np.full(8, 1.2), "inextensible", True)
    assert np.sum(elastic.tensions > 0.0) == np.sum(rigid.tensions > 0.0) == taut
    assert elastic.principal[soft - 1] < 1e-3 * elastic.principal[soft]
    assert np.sum(np.isfinite(rigid.principal)) == soft
    np.testing.assert_allclose(rigid.principal[:soft], elastic.principal[:soft], rtol=0.01)
    assert elastic.frequencies[soft - 1] < 0.02 * elastic.frequencies[soft]
    wrench = cable_state(elastic.cables, "elastic", elastic.X_WP, elastic.l0).wrench
    wrench = wrench + rigid_platform(robot).weight_wrench(elastic.X_WP)
    np.testing.assert_allclose(wrench, 0.0, atol=1e-6)


def test_command_prints_json(capsys):
    code, out, _ = call("caroca --pose 0.3,0.5,1.2,0,0,5 --cable-model catenary --json", capsys)
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


def test_command_prints_a_table_and_draws(capsys, tmp_path):
    lengths = ",".join(["1.2"] * 8)
    code, out, _ = call(
        f"acrobot_large --lengths {lengths} --no-pulleys --plot {tmp_path / 'rest.png'}", capsys
    )
    assert code == 0
    assert "pulleys ignored" in out
    assert "natural frequencies [Hz]" in out
    assert "other poses of rest" in out
    assert (tmp_path / "rest.png").stat().st_size > 10_000


def test_without_a_pose_it_is_the_home_pose(capsys):
    home = load_robot("acrobot_large").home.transform()
    code, out, _ = call("acrobot_large --json", capsys)
    assert code == 0
    assert json.loads(out)["pose"]["position_m"] == pytest.approx(home.translation())


def test_a_file_of_nonsense_is_named_first(capsys, tmp_path):
    path = tmp_path / "nonsense.yaml"
    path.write_text("nonsense\n")
    code, _, err = call(str(path), capsys)
    assert code == 2
    assert "nonsense.yaml" in err
    assert "--pose" not in err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("acrobot_large --pose 0,0,0.4 --lengths 1,1,1,1,1,1,1,1", "found both"),
        ("acrobot_large --pose 0,0", "--pose: found '0,0'"),
        ("acrobot_large --lengths 1,1,1", "accepted: 8 lengths [m]"),
        ("acrobot_large --lengths 1,1,1,1,1,1,1,-1", "lengths: found -1; accepted: > 0"),
        ("acrobot_large --pose 0,0,5", "outside the frame"),
        ("acrobot_large --pose 0.5,0.5,1.1", "reaches into the platform"),
        ("acrobot_large --pose 0.5,0,0.5", "no tensions within 0..60 N"),
        ("acrobot_large --pose 0,0,0.4 --cable-model rubber", "'rubber' is unknown"),
        ("acrobot_large --lengths .2,.2,.2,.2,.2,.2,.2,.2", "is stretched by 5"),
        ("acrobot_large --lengths 3,3,3,3,3,3,3,3", "outside the frame"),
        ("planar --lengths .6,.6,.6,.6", "no pose in the frame has them"),
        ("planar --lengths .713,.713,.713,.713 --cable-model inextensible", "mm longer"),
    ],
)
def test_bad_input_ends_in_one_line(arguments, words, capsys):
    code, out, error = call(arguments, capsys)
    assert code == 2
    assert out == ""
    assert error.count("\n") == 1
    assert words in error


def test_robots_own_breaking_load():
    robot = load_robot("planar")
    robot = replace(robot, cable=replace(robot.cable, breaking_load=100.0))
    lengths = static_at_pose(robot, robot.home.transform(), "elastic", True).l0
    static_at_lengths(robot, lengths * (1.0 - 1e-4), "elastic", True)
    with pytest.raises(CdprError, match="at most its breaking load, 100 N"):
        static_at_lengths(robot, lengths * (1.0 - 1e-3), "elastic", True)
