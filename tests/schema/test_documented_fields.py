"""Classes with a schema: `help` has the words, units and ranges of all their fields."""

from dataclasses import fields
from typing import Annotated

import pytest

from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.settings import In, OneOf, filled, settings
from cdpr_drake.systems.robots.settings import DampingSettings
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.systems.sensors.sensor_settings import SensorSuite


@settings
class Spring:
    """A spring.

    It is straight.
    """

    stiffness: Annotated[float, In("N/m", gt=0.0), "How stiff."]
    kind: Annotated[str, OneOf(("soft", "hard")), "Which."] = "soft"


@settings
class Suspension(Spring):
    kind: Annotated[str, OneOf(("hard",)), "Which it is now."] = "hard"
    inner: Annotated[Spring, "Another one."] = filled(Spring)


def test_words_units_and_ranges_stand_behind_the_class_s_own_words():
    assert Spring.__doc__ == (
        "A spring.\n\n    It is straight.\n\n    Attributes:\n"
        "        stiffness: How stiff. Accepted: a number > 0 [N/m].\n"
        "        kind: Which. Accepted: one of soft, hard."
    )
    assert Suspension.__doc__ == (
        "Suspension.\n\n    Attributes:\n"
        "        stiffness: How stiff. Accepted: a number > 0 [N/m].\n"
        "        kind: Which it is now. Accepted: one of hard.\n"
        "        inner: Another one. Accepted: a mapping."
    )


@pytest.mark.parametrize("schema", [Robot, Scenario, TensionScenario, SensorSuite, DampingSettings])
def test_no_field_of_a_schema_is_without_words(schema):
    for field in fields(schema):
        assert f"        {field.name}: {field.metadata['rule'].doc} Accepted: " in schema.__doc__
