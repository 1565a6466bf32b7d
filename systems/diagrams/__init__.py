"""Wires blocks into Diagrams: by scenario, or piece by piece into somebody's own builder.

Each `add_...` takes a builder, handles of what is there already, and one dataclass of settings, and
returns handles; `build_visual_servo` and `build_tension_control` are compositions of them.
"""

from cdpr_drake.systems.diagrams.beliefs import (
    believed_robot,
    random_shifts,
    shifted_pose,
    winch_offsets,
)
from cdpr_drake.systems.diagrams.camera import (
    add_camera,
    add_sensor,
    add_target,
    pictured_robot,
    projected_camera,
    scene_adder,
)
from cdpr_drake.systems.diagrams.controller import make_controller, make_tasks
from cdpr_drake.systems.diagrams.estimators import EstimatorInputs, add_estimator, known_tag_camera
from cdpr_drake.systems.diagrams.load import SCENARIO_SCHEMAS, load_scenario
from cdpr_drake.systems.diagrams.servo_blocks import VisualServoBlocks, add_visual_servo
from cdpr_drake.systems.diagrams.servo_models import LoopServo, ServoModel, servo_model
from cdpr_drake.systems.diagrams.servo_watches import (
    LOGGED_OF_CABLES,
    add_stability_watch,
    criterion_of,
    make_monitor,
    servo_criterion,
)
from cdpr_drake.systems.diagrams.tension_control import (
    TensionControl,
    TensionControlBlocks,
    TensionControlSettings,
    add_tension_control,
    build_tension_control,
)
from cdpr_drake.systems.diagrams.tension_loop import TensionLoop, TensionRows, can_be_compiled
from cdpr_drake.systems.diagrams.tension_management import correction_law, make_corrector
from cdpr_drake.systems.diagrams.torque_control import loop_warnings, tension_limits, torque_law
from cdpr_drake.systems.diagrams.visual_servo import (
    Addition,
    VisualServo,
    build_visual_servo,
    integration_step,
)

__all__ = [
    "LOGGED_OF_CABLES", "SCENARIO_SCHEMAS", "Addition", "EstimatorInputs", "LoopServo",
    "ServoModel", "TensionControl", "TensionControlBlocks", "TensionControlSettings", "TensionLoop",
    "TensionRows", "VisualServo", "VisualServoBlocks", "add_camera", "add_estimator", "add_sensor",
    "add_stability_watch", "add_target", "add_tension_control", "add_visual_servo",
    "believed_robot", "build_tension_control", "build_visual_servo", "can_be_compiled",
    "correction_law", "criterion_of", "integration_step", "known_tag_camera", "load_scenario",
    "loop_warnings", "make_controller", "make_corrector", "make_monitor", "make_tasks",
    "pictured_robot", "projected_camera", "random_shifts", "scene_adder", "servo_criterion",
    "servo_model", "shifted_pose", "tension_limits", "torque_law", "winch_offsets",
]  # fmt: skip
