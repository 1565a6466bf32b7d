"""Scenario files: one run each, composed of the settings of the blocks it uses.

The YAML files beside these modules come with the package. `cdpr_drake.systems.diagrams` loads,
checks and wires them.
"""

from cdpr_drake.systems.scenarios.engine_choice import (
    AnyScenario,
    engine_of,
    has_contact,
    why_many_steps,
    with_engine,
)
from cdpr_drake.systems.scenarios.files import (
    PICK_AND_PLACE,
    TENSION_CONTROL,
    VISUAL_SERVO,
    all_scenario_names,
    load_with_robot,
    robot_beside,
    scenario_file,
    scenario_kind,
    scenario_names,
)
from cdpr_drake.systems.scenarios.pick_and_place_scenario import (
    PickAndPlaceScenario,
    check_pick_and_place,
)
from cdpr_drake.systems.scenarios.pick_and_place_settings import (
    COVERED_IN,
    GOAL_TAG,
    OBJECT_TAG,
    GripperSettings,
    HandlingSettings,
    PlacedTag,
    WorkpieceSettings,
)
from cdpr_drake.systems.scenarios.run_settings import DIAGRAM, ExpectedEnd, ScenarioHeader
from cdpr_drake.systems.scenarios.tension_control_scenario import (
    DrivenCableSettings,
    Stretch,
    TensionScenario,
)
from cdpr_drake.systems.scenarios.visual_servo_scenario import DEFAULT_SCENARIO, Scenario
from cdpr_drake.systems.scenarios.visual_servo_settings import VisualServoSettings

__all__ = [
    "COVERED_IN", "DEFAULT_SCENARIO", "DIAGRAM", "GOAL_TAG", "OBJECT_TAG", "PICK_AND_PLACE",
    "TENSION_CONTROL", "VISUAL_SERVO", "AnyScenario", "DrivenCableSettings", "ExpectedEnd",
    "GripperSettings", "HandlingSettings", "PickAndPlaceScenario", "PlacedTag", "Scenario",
    "ScenarioHeader", "Stretch", "TensionScenario", "VisualServoSettings", "WorkpieceSettings",
    "all_scenario_names", "check_pick_and_place", "engine_of", "has_contact", "load_with_robot",
    "robot_beside", "scenario_file", "scenario_kind", "scenario_names", "why_many_steps",
    "with_engine",
]  # fmt: skip
