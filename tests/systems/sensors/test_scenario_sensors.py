"""Sensors of scenarios: what is logged, with which errors and rates, drawn, continued, refused."""

from dataclasses import replace

import numpy as np
import pytest
import yaml
from pydrake.geometry import Box, Role
from pydrake.systems.analysis import InitializeParams, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from cdpr_drake.analyses.runs.engine import fixed_step_simulator
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.cli.app import main
from cdpr_drake.errors import RobotFileError, ScenarioError
from cdpr_drake.geometry.poses import pose_from_row, pose_rows_distance, rotation_vector
from cdpr_drake.models.robot_loader import load_robot, robot_file
from cdpr_drake.models.sensor_catalogue import load_tension_sensor
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.loops.loop_choice import diagram_reason
from cdpr_drake.systems.monitoring.context_state import has_arrays_only, restore_state, state_arrays
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.sensors import add_perception_sensors
from tests.messages import printed

ENGINE = "integration.engine=compiled"
READ, LOOKING = "acrobot_sensors", "acrobot_perception"
QUICK = ("camera.kind=projected", "duration=1.0", "log_rate=100", "sensors.metrology_rate=80")
SHORT = ("duration=0.3", ENGINE, "log_rate=50")
NO_DEPTH = (*SHORT, "sensors.depth=null")
SAME_FRAMES = 1e-9
VLU850 = load_tension_sensor("vlu850")
TRACTEL = ("sensors.tension=tractel", "sensors.log=[tension]")


def run_of(name, *changes):
    return ServoRun(load_scenario(name, changes)).simulate()


def servo_of(name, *changes):
    return build_visual_servo(load_scenario(name, changes))


@pytest.fixture(scope="module")
def reading():
    return run_of(READ, *QUICK, ENGINE)


@pytest.fixture(scope="module")
def looking():
    return run_of(LOOKING, *SHORT)


def test_all_readings_are_logged_with_their_units(reading, looking):
    assert set(reading.columns()) >= {
        "measured_tensions.C1_n", "measured_lengths.C8_m", "X_WP_measured.x_m", "X_WP_metrology.qw",
    }  # fmt: skip
    assert set(looking.columns()) >= {
        "scan_front.681_m", "scan_beam.0_m", "specific_force.z_m_s2", "angular_velocity.x_rad_s",
        "imu_biases.wz_rad_s", "depth_row.159_m", "pan_tilt_encoders.tilt_rad",
        "X_WO_odometry.qw", "wheel_distances.right_m",
    }  # fmt: skip


def test_readings_are_wrong_by_the_errors_of_their_types(reading):
    # Readings at the rate of the log; a row shows those of the row before.
    shown = {name: values[2:] for name, values in reading.log.items()}
    true = {name: values[1:-1] for name, values in reading.log.items()}
    wrong = shown["measured_tensions"] - true["tensions"]
    assert np.max(np.abs(wrong)) < VLU850.accuracy + 5.0 * VLU850.repeatability
    assert np.max(np.abs(np.mean(wrong, axis=0))) > 10.0 * VLU850.repeatability
    half_count = np.pi / 65536 * 0.0041
    wrong = np.abs(shown["measured_lengths"] - true["unstrained_lengths"])
    assert 0.0 < np.max(wrong) < half_count * (1.0 + 1e-6)
    far, _ = pose_rows_distance(true["X_WP"], shown["X_WP_measured"])
    assert 3e-3 < np.median(far) < 2e-2


def test_metrology_is_right_to_its_accuracy_while_the_platform_rests():
    log = run_of(READ, *QUICK, "duration=0.04").log
    away, _ = pose_rows_distance(log["X_WP"], log["X_WP_metrology"])
    assert np.max(np.abs(away - 1e-4)) < 1e-4


def test_without_constant_errors_nothing_is_left_but_noise():
    log = run_of(READ, *QUICK, "duration=0.1", "sensors.tension_accuracy=0").log
    wrong = log["measured_tensions"][2:] - log["tensions"][1:-1]
    assert np.max(np.abs(wrong)) < 6.0 * VLU850.repeatability


def test_sensors_that_nothing_reads_are_not_there():
    servo = servo_of(READ, *QUICK, "sensors.log=[]")
    for name in ("tension_sensors", "encoders", "tracker", "metrology"):
        assert not servo.diagram.HasSubsystemNamed(name)


def test_readings_of_slack_cables_stand_in_the_robots_file(tmp_path):
    """The sensors of CAROCA show them in a scenario; there is one for each cable."""
    slack = load_robot("caroca").slack_readings
    np.testing.assert_array_equal(slack, [120.0, 90.0, 90.0, 50.0, 90.0, 100.0, 0.0, -20.0])
    log = run_of("caroca_pbvs", *QUICK, *TRACTEL, "duration=0.1").log
    shown = np.median(log["measured_tensions"] - log["tensions"], axis=0)
    assert np.max(np.abs(shown - slack)) < 75.0 + 10.0
    content = yaml.safe_load(robot_file("caroca").read_text())
    content["slack_readings"] = [1.0, 2.0]
    path = tmp_path / "robot.yaml"
    path.write_text(yaml.safe_dump(content))
    with pytest.raises(RobotFileError, match=r"slack_readings: found 2 numbers; accepted: one for"):
        load_robot(str(path))


def test_steps_and_rates_of_sensors_fit():
    """An automatic step meets the fastest sensor; a rate above that of a given step is named."""
    assert servo_of("caroca_pbvs", *QUICK).max_step > 1.0 / 512.0
    assert servo_of("caroca_pbvs", *QUICK, *TRACTEL).max_step == 1.0 / 512.0
    changes = [*QUICK, "integration.max_step=0.002"]
    assert servo_of(READ, *changes, "sensors.tension_rate=500").max_step == 0.002
    with pytest.raises(
        ScenarioError, match=r"sensors\.tension_rate: found 510; accepted: at most 5"
    ):
        servo_of(READ, *changes, "sensors.tension_rate=510")


REFUSED = [
    (READ, "sensors.tension=hbm", "sensors.tension: found hbm; accepted: one of ideal, tractel, v"),
    (READ, "sensors.tracker_rate=121",
     "sensors.tracker_rate: found 121; accepted: at most 120 [Hz], that of vive"),
    (READ, "sensors.encoder_rate=0", "sensors.encoder_rate: found 0; accepted: a number > 0 [Hz]"),
    (READ, "sensors.log=[tension, tension]", "sensors.log[1]: found tension twice; accepted"),
    (READ, "sensors.log=[speed]", "sensors.log[0]: found speed; accepted"),
    (LOOKING, "sensors.imu.rate=300", "sensors.imu.rate: found 300; accepted: at most 200"),
    (LOOKING, "sensors.range_sensors=[{name: a}, {name: a}]",
     "range_sensors[1].name: found a twice"),
    (LOOKING, "sensors.pan_tilt=null",
     "range_sensors[1].carrier: found pan_tilt, which is not there"),
    (LOOKING, "sensors.pan_tilt.lower_deg=[80,0]",
     "pan_tilt.lower_deg: found (80, 0); accepted: at most upper_deg"),
    (LOOKING, "sensors.depth.carrier=hose",
     "depth.carrier: found hose, which is not there; accepted"),
    (LOOKING, "target.motion=null",
     "sensors.odometry: found a target that no mobile robot carries"),
    (LOOKING, "world={obstacles: [{name: pan_tilt, kind: sphere, radius: 0.1, pose: {position: "
     "[9, 9, 9]}}]}",
     "world.obstacles[0].name: found pan_tilt"),
    (LOOKING, "sensors.range_sensors=[{name: a, type: hokuyu}]", "hokuyu"),
    (LOOKING, "sensors.depth.binning=0", "binning"),
    ("caroca_world", "sensors.range_sensors=[{name: a, carrier: barrier_a}]",
     "carrier: found barrier_a, which is not there"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "change", "words"), REFUSED)
def test_sensors_that_cannot_be_are_refused_by_name(name, change, words):
    with pytest.raises(ScenarioError) as refused:
        load_scenario(name, [change])
    assert words in str(refused.value)
    assert len(str(refused.value)) <= 500


def test_the_command_line_ends_with_2_and_writes_nothing(tmp_path, capsys):
    out = tmp_path / "run"
    with pytest.raises(SystemExit) as end:
        main(["simulate", LOOKING, "--set", "sensors.depth.rate=1000", "--out", str(out)])
    assert end.value.code == 2
    assert "sensors.depth.rate: found 1000" in printed(capsys).err
    assert not out.exists()


def test_readings_oftener_than_steps_are_refused():
    scenario = load_scenario(LOOKING, [*NO_DEPTH, "integration.max_step=0.02"])
    with pytest.raises(ScenarioError, match=r"sensors\.range_sensors\[0\]|sensors\.imu\.rate"):
        build_visual_servo(replace(scenario, sensors=replace(scenario.sensors, range_sensors=[])))


def test_a_loop_without_a_diagram_leaves_sensors_of_a_scene_to_a_diagram():
    reason = diagram_reason(load_scenario(LOOKING, NO_DEPTH))
    assert reason == "its section sensors.imu adds blocks to a diagram"


def test_odometry_is_right_at_the_start_and_drifts(looking):
    rows = looking.log["X_WO_odometry"]
    start = looking.built.motion.at(0.0).translation()
    np.testing.assert_allclose(rows[0, 4:], start, atol=1e-12)
    distance, _ = pose_rows_distance(rows[-1:], rows[:1])
    assert distance[0] > 1e-3


def test_each_sensor_has_its_own_rate(looking):
    for name, most in (("scan_front", 4), ("depth_row", 3), ("specific_force", 16)):
        rows = looking.log[name]
        assert 1 <= np.sum(np.any(rows[1:] != rows[:-1], axis=1)) <= most, name


def test_each_sensor_has_a_figure(looking):
    drawn = {"scan_front", "scan_beam", "imu", "depth", "pan_tilt", "odometry"}
    assert drawn <= set(looking.figures())
    assert looking.at_end["depth_image"].shape == (120, 160)
    without = ServoRun(load_scenario("acrobot_moving_tag", SHORT))
    without.log = looking.log
    assert "imu" not in without.figures()


def test_a_beam_on_the_head_ends_where_the_head_says():
    """Its end, by the head's angles, is on the surface of one of the frame's boxes."""
    servo = servo_of(LOOKING, *NO_DEPTH)
    context = servo.make_context()
    head, beam = (servo.diagram.GetSubsystemByName(name) for name in ("pan_tilt", "scan_beam"))
    X_HS = servo.scenario.sensors.range_sensors[1].pose.transform()
    scene = servo.block.scene_graph
    query = scene.get_query_output_port().Eval(scene.GetMyContextFromRoot(context))
    inspector, met = query.inspector(), 0
    boxes = [
        (query.GetPoseInWorld(g).inverse(), inspector.GetShape(g).size() / 2)
        for g in inspector.GetAllGeometryIds(Role.kPerception)
        if isinstance(inspector.GetShape(g), Box)
    ]
    for pan in np.linspace(-1.0, 1.0, 41):
        angles = np.array([pan, -0.1])
        own = head.GetMyMutableContextFromRoot(context)
        own.SetDiscreteState(np.concatenate([angles, np.zeros(3)]))
        (found,) = beam.truth(beam.GetMyContextFromRoot(context))
        if np.isinf(found):
            continue
        X_WS = servo.true_pose(context) @ head.head(angles) @ X_HS
        end = X_WS @ np.array([found, 0.0, 0.0])
        outside = [np.max(np.abs(X_GW @ end) - half) for X_GW, half in boxes]
        assert np.min(np.abs(outside)) < SAME_FRAMES
        met += 1
    assert met > 0


def test_a_robot_without_a_servo_reads_the_same():
    """By the same blocks and the same random numbers, under names of its own."""
    servo = servo_of(LOOKING, *NO_DEPTH, "target.motion=null", "sensors.odometry=null")
    builder, scenario = DiagramBuilder(), servo.scenario
    robot = builder.AddNamedSystem("robot", CompiledCableRobot(servo.robot, scenario))
    still = builder.AddSystem(ConstantVectorSource(np.zeros(len(servo.robot.cables))))
    builder.Connect(still.get_output_port(), robot.GetInputPort("cable_velocities"))
    ports = add_perception_sensors(builder, robot, scenario.sensors, seed=scenario.seed, name="r")
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    pose = scenario.initial_pose.transform()
    robot.set_at_equilibrium(robot.GetMyMutableContextFromRoot(context), pose)
    Simulator(diagram, context).AdvanceTo(0.0)
    whole = servo.make_context()
    Simulator(servo.diagram, whole).AdvanceTo(0.0)
    assert set(ports) == {
        "specific_force", "angular_velocity", "imu_biases", "pan_tilt_angles", "pan_tilt_encoders",
        "scan_front", "scan_beam",
    }  # fmt: skip
    for name in ("pan_tilt_encoders", "imu_biases", "angular_velocity", "scan_beam"):
        block = {"pan": "pan_tilt", "scan": "scan_beam"}.get(name.split("_")[0], "imu")
        system = servo.diagram.GetSubsystemByName(block)
        port = system.GetOutputPort(ports[name].get_name())
        own = ports[name].get_system()
        assert own.get_name() == f"r_{block}"
        np.testing.assert_allclose(
            ports[name].Eval(own.GetMyContextFromRoot(context)),
            port.Eval(system.GetMyContextFromRoot(whole)), atol=SAME_FRAMES,
        )  # fmt: skip


def test_a_moving_target_can_carry_a_sensor():
    """A beam on the mobile robot looks up at the platform: that is as high as the log says."""
    pose = "{position: [0.06, 0, 0], angles_deg: [0, -90, 0]}"
    up = f"sensors.range_sensors=[{{name: up, type: beam, carrier: target, pose: {pose}}}]"
    servo = servo_of(LOOKING, *NO_DEPTH, up)
    context = servo.make_context()
    beam = servo.diagram.GetSubsystemByName("scan_up")
    (found,) = beam.truth(beam.GetMyContextFromRoot(context))
    bottom = servo.true_pose(context).translation()[2]  # P is in the middle of the bottom face
    height = servo.motion.at(0.0).translation()[2]
    assert found == pytest.approx(bottom - height, abs=SAME_FRAMES)


GROUND, EXACT = -1e-3, 1e-6
"""Height of the ground of the Gazebo thesis, and the bound for scans without noise [m]."""


@pytest.fixture(scope="module")
def hose():
    return servo_of("caroca_world", "camera.kind=projected", ENGINE)


@pytest.mark.parametrize("time", [0.0, 0.7])
def test_beams_of_a_scanner_on_the_hose_end_on_the_ground_and_never_below(hose, time):
    """While the hose swings: the ground stays where it is."""
    context = hose.make_context()
    context.SetTime(time)
    own, start = hose.block.GetMyMutableContextFromRoot(context), hose.scenario.initial_pose
    hose.block.set_at_equilibrium(own, start.transform())
    sensor = hose.diagram.GetSubsystemByName("scan_hokuyo")
    found = sensor.truth(sensor.GetMyContextFromRoot(context))
    carrier = next(body for body in hose.scenario.world.obstacles if body.name == "hose")
    X_WS = carrier.path().at(time) @ hose.scenario.sensors.range_sensors[0].pose.transform()
    there = np.isfinite(found)
    angles = sensor.angles[there]
    p_S = found[there] * np.array([np.cos(angles), np.sin(angles), np.zeros(len(angles))])
    heights = (X_WS @ p_S)[2]
    assert np.min(heights) == pytest.approx(GROUND, abs=EXACT)
    assert np.sum(np.abs(heights - GROUND) < EXACT) > 100


def test_an_imu_without_errors_reads_the_motion():
    """The angular velocity is that of the log, and gravity is up on average."""
    log = run_of(LOOKING, *NO_DEPTH, "sensors.imu.type=ideal", "sensors.imu.rate=50").log
    poses = [pose_from_row(row) for row in log["X_WP"]]
    dt = log["time"][1] - log["time"][0]
    for k in range(3, 12):
        turn = rotation_vector(poses[k - 2].rotation().inverse() @ poses[k].rotation()) / (2 * dt)
        np.testing.assert_allclose(log["angular_velocity"][k], turn, atol=0.08)
    assert np.mean(log["specific_force"][:, 2]) == pytest.approx(9.81, abs=1.5)


def test_a_sensor_more_changes_nothing_of_the_others():
    few = run_of(LOOKING, *NO_DEPTH, "duration=0.1", "sensors.imu=null").log
    more = run_of(LOOKING, *NO_DEPTH, "duration=0.1").log
    np.testing.assert_array_equal(few["wheel_distances"], more["wheel_distances"])
    np.testing.assert_allclose(few["scan_front"][:4], more["scan_front"][:4], atol=1e-6)


def test_a_run_that_is_continued_reads_the_same():
    """Biases, odometry and the head are state; all that is random goes by the sample's number."""
    servo = servo_of(LOOKING, *NO_DEPTH, "duration=0.2")
    context = servo.make_context()
    simulator = fixed_step_simulator(servo.diagram, context, "runge_kutta3", servo.max_step)
    simulator.AdvanceTo(0.1)
    assert has_arrays_only(context)
    kept = {name: values.copy() for name, values in state_arrays(context).items()}
    simulator.AdvanceTo(0.2)
    again = servo.make_context()
    restore_state(again, kept)
    simulator = fixed_step_simulator(servo.diagram, again, "runge_kutta3", servo.max_step)
    params = InitializeParams()
    params.suppress_initialization_events = True
    simulator.Initialize(params)
    simulator.AdvanceTo(0.2)
    whole, part = servo.log.read(context), servo.log.read(again)
    for name, values in part.items():
        np.testing.assert_array_equal(whole[name][-len(values) + 1 :], values[1:], err_msg=name)
