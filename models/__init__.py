"""Robots as data: their files, schema and loader, and what builds them into a MultibodyPlant.

A robot is a folder of `robots/` with a YAML file and a README of provenance; `load_robot` reads it,
`Robot.cable_set()` gives all constants of its cables. Cameras and sensors are catalogues of what
manufacturers publish. `add_robot` puts a platform into anybody's plant. Poses in files are position
[m] and angles (phi, theta, psi) in degrees, R = Rx Ry Rz.

Source: each robot's README.
"""

from cdpr_drake.models.camera_catalogue import (
    DEAD,
    FROZEN,
    OFF,
    Camera,
    CameraFault,
    camera_names,
    load_camera,
)
from cdpr_drake.models.formats import SUFFIXES as ROBOT_SUFFIXES
from cdpr_drake.models.formats import is_foreign
from cdpr_drake.models.hardware import MARK as RAILS_MARK
from cdpr_drake.models.placement import (
    gravity_turn,
    moved_robot,
    portable_robot,
    turned_robot,
    world_turn,
)
from cdpr_drake.models.rendered_camera import (
    BACKGROUND,
    NEAR,
    add_renderer,
    check_rendering,
    color_camera,
    make_depth_camera,
    make_rgbd_sensor,
    probe_rendering,
    render_once,
)
from cdpr_drake.models.robot_exchange import (
    ImportedRobot,
    draft_robot,
    import_robot,
    write_robot,
)
from cdpr_drake.models.robot_exports import (
    EXPORTS,
    HELD,
    given_fields,
    not_written,
    not_written_words,
)
from cdpr_drake.models.robot_holding import (
    check_bundles,
    check_pulleys,
    hold_robot,
    rest_as_long,
    rest_with_slack,
)
from cdpr_drake.models.robot_in_plant import (
    RobotInPlant,
    add_robot,
    platform_box,
    platform_inertia,
    pose_from_state,
    pose_on_joint,
)
from cdpr_drake.models.robot_loader import (
    load_robot,
    parse_robot,
    robot_file,
    robot_names,
    robot_text,
)
from cdpr_drake.models.robot_schema import CameraMount, Pose, Robot
from cdpr_drake.models.robot_statics import (
    WrenchBalance,
    check_pose,
    hanging_platform,
    rigid_platform,
    tension_problem,
    wrench_balance,
)
from cdpr_drake.models.scene import (
    FLOOR_COLOR,
    add_frame,
    add_ground,
    add_plates,
    add_tag,
    plate_geometry,
)
from cdpr_drake.models.sensor_catalogue import (
    DepthSensorModel,
    EncoderModel,
    InertialSensorModel,
    PoseSensorModel,
    RangeSensorModel,
    TensionSensorModel,
    depth_sensor_names,
    encoder_names,
    inertial_sensor_names,
    load_depth_sensor,
    load_encoder,
    load_inertial_sensor,
    load_pose_sensor,
    load_range_sensor,
    load_tension_sensor,
    pose_sensor_names,
    range_sensor_names,
    tension_sensor_names,
)
from cdpr_drake.models.ups_robot import UpsInPlant, add_ups_robot, rod_masses

__all__ = [
    "BACKGROUND", "DEAD", "EXPORTS", "FLOOR_COLOR", "FROZEN", "HELD", "NEAR", "OFF", "RAILS_MARK",
    "ROBOT_SUFFIXES", "Camera", "CameraFault", "CameraMount", "DepthSensorModel", "EncoderModel",
    "ImportedRobot", "InertialSensorModel", "Pose", "PoseSensorModel", "RangeSensorModel", "Robot",
    "RobotInPlant", "TensionSensorModel", "UpsInPlant", "WrenchBalance", "add_frame", "add_ground",
    "add_plates", "add_renderer", "add_robot", "add_tag", "add_ups_robot", "camera_names",
    "check_bundles", "check_pose", "check_pulleys", "check_rendering", "color_camera",
    "depth_sensor_names", "draft_robot", "encoder_names", "given_fields", "gravity_turn",
    "hanging_platform", "hold_robot", "import_robot", "inertial_sensor_names", "is_foreign",
    "load_camera", "load_depth_sensor", "load_encoder", "load_inertial_sensor",
    "load_pose_sensor", "load_range_sensor", "load_robot", "load_tension_sensor",
    "make_depth_camera", "make_rgbd_sensor", "moved_robot", "not_written", "not_written_words",
    "parse_robot", "plate_geometry", "platform_box", "platform_inertia", "portable_robot",
    "pose_from_state", "pose_on_joint", "pose_sensor_names", "probe_rendering",
    "range_sensor_names", "render_once", "rest_as_long", "rest_with_slack", "rigid_platform",
    "robot_file", "robot_names", "robot_text", "rod_masses", "tension_problem",
    "tension_sensor_names", "turned_robot", "world_turn", "wrench_balance", "write_robot",
]  # fmt: skip
