"""Files that are too large, or become so where aliases are expanded, are one line."""

import numpy as np
import pytest

from cdpr_drake.errors import DataFileError, RobotFileError, ScenarioError
from cdpr_drake.models.robot_loader import load_robot, robot_file
from cdpr_drake.schema.typed_yaml import load_typed
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.files import scenario_kind


def bomb(levels=12, width=10):
    """Aliases of aliases: `width` to the power of `levels` words from one kilobyte."""
    lines = ["a0: &a0 [x, x]"]
    for level in range(1, levels):
        lines.append(f"a{level}: &a{level} [{', '.join([f'*a{level - 1}'] * width)}]")
    return "\n".join(lines)


@pytest.mark.parametrize(
    ("content", "found"),
    [
        (bomb(), "found more than 100,000 keys and values"),
        ("name: [" + "1, " * 700_000 + "1]", "found 2,100,009 bytes; accepted: at most 262,144"),
        ("a: &a [*a]", "found an alias within what it names"),
    ],
    ids=["bomb", "long", "itself"],
)
def test_robots_and_scenarios_that_are_too_large_are_refused(content, found, tmp_path):
    path = tmp_path / "large.yaml"
    path.write_text(content, encoding="utf-8")
    assert scenario_kind(str(path)) == "visual_servo"  # whose loader says what is wrong
    for load, error in ((load_robot, RobotFileError), (load_scenario, ScenarioError)):
        with pytest.raises(error, match=found) as caught:
            load(str(path))
        assert len(str(caught.value)) <= 500 + len(str(path))


def test_a_bomb_on_the_command_line_is_refused():
    words = "{" + bomb().replace("\n", ", ") + "}"
    with pytest.raises(ScenarioError) as caught:
        load_scenario("acrobot_pbvs", [f"seed={words}", f"camera={words}"])
    assert len(str(caught.value).splitlines()[0]) <= 500


def test_aliases_of_a_reasonable_file_are_taken(tmp_path):
    path = tmp_path / "robot.yaml"
    content = robot_file("acrobot_small").read_text(encoding="utf-8")
    assert "lower:" in content
    path.write_text(content, encoding="utf-8")
    assert load_robot(str(path)).name == "acrobot_small"


def test_a_file_that_vanishes_is_named(tmp_path):
    with pytest.raises(DataFileError, match="cannot be read"):
        load_typed(object, tmp_path / "none.yaml")


@pytest.mark.parametrize(
    ("line", "other", "message"),
    [
        (
            "mass: ",
            "mass: 1e25",
            r"platform\.mass: found 1e25; accepted: a number > 0 and <= 1e\+07 \[kg\]",
        ),
        ("youngs_modulus: ", "youngs_modulus: 1e25", r"cable\.youngs_modulus: found 1e25"),
        ("beam: ", "beam: 50.0", r"frame\.beam: found 50; accepted: at most .* the frame's width"),
    ],
)
def test_numbers_that_no_robot_has_are_refused(line, other, message, tmp_path):
    lines = robot_file("acrobot_small").read_text(encoding="utf-8").splitlines()
    index = next(k for k, words in enumerate(lines) if words.strip().startswith(line))
    indent = lines[index][: len(lines[index]) - len(lines[index].lstrip())]
    lines[index] = indent + other
    path = tmp_path / "robot.yaml"
    path.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(RobotFileError, match=message) as caught:
        load_robot(str(path))
    assert len(str(caught.value).splitlines()) == 1


def test_a_home_outside_the_frame_is_refused(tmp_path):
    robot = load_robot("acrobot_small")
    away = (np.asarray(robot.frame.upper) + 1.0).tolist()
    content = robot_file("acrobot_small").read_text(encoding="utf-8")
    start = content.index("\nhome:")
    end = content.find("\n", start + 1)
    while end >= 0 and content[end + 1 : end + 2] == " ":
        end = content.find("\n", end + 1)
    path = tmp_path / "robot.yaml"
    path.write_text(
        content[:start] + f"\nhome: {{position: {away}}}" + content[end:], encoding="utf-8"
    )
    with pytest.raises(RobotFileError, match=r"home\.position: found .*accepted: within the frame"):
        load_robot(str(path))
