"""What simulations of a shipped robot depend on and its file does not give is in `assumptions`."""

import re

import pytest

from cdpr_drake.models.robot_loader import load_robot, robot_names

WORDS = {
    "platform.center_of_mass": r"platform\.center_of_mass: |[Cc]entre of mass",
    "platform.inertia": r"platform\.inertia: |[Ii]nertia (from|of) a solid box|inertia is that of",
    "cable_model": r"cable_model: ",
    "damping": r"damping: ",
    "winch.friction": r"winch\.friction: ",
}
"""How the texts name what is filled in, by key."""


@pytest.mark.parametrize("name", robot_names())
def test_what_is_filled_in_is_named(name):
    robot = load_robot(name)
    for key, value in robot.filled_in().items():
        assert re.search(WORDS[key], robot.assumptions), f"{name}: {key}, {value}"
    assert ("not in its file", "nothing") not in robot.summary()[1] or not robot.filled_in()


def test_the_table_of_a_robot_shows_what_was_filled_in():
    rows = dict(load_robot("acrobot_small").summary()[1])
    assert rows["not in its file"] == (
        "platform.center_of_mass: the middle of its box, (0, 0, 0.035) m; platform.inertia: that "
        "of a solid box; cable_model: straight, without weight; damping: none"
    )
    rows = dict(load_robot("caroca").summary()[1])
    assert "damping" not in rows["not in its file"]
    assert "fitted, not printed" in load_robot("caroca").assumptions
    assert "240 N s/m" in load_robot("caroca").assumptions
