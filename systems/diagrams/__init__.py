"""Wires blocks into Diagrams: by scenario, or piece by piece into somebody's own builder.

Each `add_...` takes a builder, handles of what is there already, and one dataclass of settings, and
returns handles; `build_visual_servo` and `build_tension_control` are compositions of them.
"""

from cdpr_drake.systems.diagrams.beliefs import believed_robot
from cdpr_drake.systems.diagrams.camera import add_camera, add_sensor, add_target, scene_adder
from cdpr_drake.systems.diagrams.controller import make_controller, make_tasks
from cdpr_drake.systems.diagrams.estimators import EstimatorInputs, add_estimator
from cdpr_drake.systems.diagrams.load import SCENARIO_SCHEMAS, load_scenario
from cdpr_drake.systems.diagrams.servo_blocks import VisualServoBlocks, add_visual_servo
from cdpr_drake.systems.diagrams.stability_along import add_stability_watch, criterion_of
from cdpr_drake.systems.diagrams.tension_control import (
    TensionControl,
    TensionControlBlocks,
    TensionControlSettings,
    add_tension_control,
    build_tension_control,
)
from cdpr_drake.systems.diagrams.tension_loop import TensionLoop, can_be_compiled
from cdpr_drake.systems.diagrams.tension_management import correction_law
from cdpr_drake.systems.diagrams.torque_control import loop_warnings, tension_limits, torque_law
from cdpr_drake.systems.diagrams.visual_servo import Addition, VisualServo, build_visual_servo

__all__ = [
    "SCENARIO_SCHEMAS", "Addition", "EstimatorInputs", "TensionControl", "TensionControlBlocks",
    "TensionControlSettings", "TensionLoop", "VisualServo", "VisualServoBlocks", "add_camera",
    "add_estimator", "add_sensor", "add_stability_watch", "add_target", "add_tension_control",
    "add_visual_servo", "believed_robot", "build_tension_control", "build_visual_servo",
    "can_be_compiled", "correction_law", "criterion_of", "load_scenario",
    "loop_warnings", "make_controller",
    "make_tasks", "scene_adder", "tension_limits", "torque_law",
]  # fmt: skip
