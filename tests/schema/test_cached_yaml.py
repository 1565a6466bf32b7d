"""Files that were read before: what they say is the same, checked again, and everybody's own."""

import numpy as np
import pytest

from cdpr_drake.errors import RobotFileError
from cdpr_drake.models.robot_loader import load_robot, robot_file
from cdpr_drake.schema import yaml_files
from cdpr_drake.systems.diagrams.load import load_scenario


@pytest.fixture(autouse=True)
def nothing_is_kept(monkeypatch):
    monkeypatch.setattr(yaml_files, "_KEPT", type(yaml_files._KEPT)())


@pytest.fixture
def parsed(monkeypatch):
    """Texts in the order in which PyYAML takes them apart."""
    texts, compose = [], yaml_files.compose_yaml

    def counted(content):
        texts.append(content)
        return compose(content)

    monkeypatch.setattr(yaml_files, "compose_yaml", counted)
    return texts


def test_a_robot_is_parsed_once_and_everybody_has_an_own_one(parsed):
    first = load_robot("acrobot_small")
    mass = first.platform.mass
    first.platform.mass = 17.0
    first.cables[0].exit_point[:] = np.nan
    second = load_robot("acrobot_small")
    assert len(parsed) == 1
    assert second.platform.mass == mass
    assert np.all(np.isfinite(second.cables[0].exit_point))


def test_a_file_that_changes_is_another_one(tmp_path):
    file = tmp_path / "robot.yaml"
    text = robot_file("acrobot_small").read_text()
    assert "\nname: acrobot_small" in f"\n{text}"
    for name in ("one", "two", "one"):
        file.write_text(text.replace("name: acrobot_small", f"name: {name}", 1))
        assert load_robot(str(file)).name == name


def test_what_is_wrong_is_said_in_the_same_words_again(tmp_path):
    file = tmp_path / "robot.yaml"
    text = robot_file("acrobot_small").read_text()
    file.write_text(text.replace("name: acrobot_small", "name: acrobot_small\nmasss: 1e1", 1))
    said = []
    for _ in range(3):
        with pytest.raises(RobotFileError) as caught:
            load_robot(str(file))
        said.append(str(caught.value))
    assert "masss" in said[0]
    assert said[0] == said[1] == said[2]
    assert all(content != file.read_text() for _, content in yaml_files._KEPT)


def test_values_of_one_command_do_not_reach_the_next():
    assert load_scenario("acrobot_pbvs", ["seed=17"]).seed == 17
    assert load_scenario("acrobot_pbvs").seed != 17


def test_a_check_is_made_every_time(monkeypatch):
    load_robot("acrobot_small")
    monkeypatch.setattr("cdpr_drake.models.robot_loader.LARGEST_LENGTH", 1e-3)
    with pytest.raises(RobotFileError):
        load_robot("acrobot_small")


def test_few_are_kept_and_no_large_ones(monkeypatch):
    for number in range(yaml_files.MOST + 5):
        yaml_files.cached_yaml(dict, f"a: {number}", edited=False)
    assert len(yaml_files._KEPT) == yaml_files.MOST
    large = "a" * (yaml_files.SMALL + 1)
    yaml_files.cached_yaml(dict, large, edited=False)
    yaml_files.cached_yaml(dict, "b: 1", edited=True)
    assert not {(dict, large), (dict, "b: 1")} & set(yaml_files._KEPT)
