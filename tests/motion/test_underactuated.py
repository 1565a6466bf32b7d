"""What fewer cables than degrees of freedom control, in numbers, words and commands."""

import json

import numpy as np
import pytest
import yaml

from cdpr_drake.analyses.statics.static_query import static_at_lengths, static_at_pose
from cdpr_drake.analyses.workspaces.workspace import compute_workspace
from cdpr_drake.cli.app import main
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_statics import wrench_balance
from cdpr_drake.statics.controlled_wrenches import combination_words
from tests.messages import printed
from tests.motion.small_robots import content, small_robot


def test_what_four_cables_cannot_control():
    robot = small_robot("hanging_four")
    home, cables = robot.home.transform(), robot.cable_set()
    control, paths = wrench_balance(robot, home).control(), cable_paths(home, cables)
    assert control.rank == 4
    assert control.free.shape == (6, 2)
    np.testing.assert_allclose(paths.J @ control.free, 0.0, atol=1e-9)
    assert not control.balances
    assert control.tensions is None
    # A pose of rest is held by its tensions.
    report = static_at_lengths(robot, paths.lengths, "elastic", False)
    control = wrench_balance(robot, report.X_WP).control()
    assert control.balances
    np.testing.assert_allclose(control.tensions, report.tensions, rtol=1e-6)
    l0 = static_at_pose(robot, report.X_WP, "elastic", False).l0
    np.testing.assert_allclose(l0, paths.lengths, rtol=1e-8)


@pytest.mark.parametrize(
    ("shares", "words"),
    [
        ([0.0, 1.0, 0.0], "force along y"),
        ([0.0, 1.0, -0.5], "force along y - 0.5 force along z"),
        ([1.0, 0.25, 0.0], "moment about x + 0.25 m force along y"),
    ],
)
def test_combinations_in_words(shares, words):
    names = ("moment about x", "force along y", "force along z")
    assert combination_words(np.array(shares), names) == words


@pytest.fixture
def answer(capsys, tmp_path):
    """What a command says of a robot of `MOTIONS`."""

    def run(command, name, *arguments):
        path = tmp_path / f"{name}.yaml"
        path.write_text(yaml.safe_dump(content(name)), encoding="utf-8")
        with pytest.raises(SystemExit) as caught:
            main([command, str(path), *arguments])
        out, err = printed(capsys)
        assert caught.value.code == 0, err
        return json.loads(out) if "--json" in arguments else out

    return run


def test_tension_says_what_cannot_be_controlled(answer):
    numbers = answer("tension", "pendulum", "--pose", "0,0,0.5", "--json")
    assert (numbers["rank"], numbers["degrees_of_freedom"]) == (1, 3)
    assert numbers["status"] == "feasible"
    assert numbers["tensions_n"] == pytest.approx([2.0 * 9.81])
    combinations = [row["combination"] for row in numbers["uncontrolled"]]
    assert combinations == ["force along x", "force along y"]
    aside = answer("tension", "pendulum", "--pose", "0.5,0,0.5")
    assert "infeasible" in aside
    assert "no tensions change" in aside
    four = answer("tension", "hanging_four", "--pose", "0,0,0.3")
    assert "4 cables for 6 degrees of freedom, which control 4 of them here" in four


def test_static_finds_the_pose_of_rest_and_its_frequencies(answer):
    model = ("--cable-model", "inextensible")
    numbers = answer("static", "pendulum", "--lengths", "1.5", "--json", *model)
    assert numbers["frequencies_hz"] == pytest.approx([np.sqrt(9.81 / 1.5) / (2 * np.pi)] * 2)
    assert numbers["pose"]["position_m"] == pytest.approx([0.0, 0.0, 0.5])


@pytest.mark.parametrize(
    ("name", "grid"), [("tripod", (3, 3, 3)), ("upright_body", (3, 1, 3)), ("lift", (1, 1, 3))]
)
def test_a_workspace_of_points_and_of_an_upright_plane(name, grid):
    report = compute_workspace(small_robot(name), "static", grid).as_dict()
    assert 0.0 < report["workspaces"]["static"]["pose_share"] <= 1.0
