"""Section `sensors` with what looks round: what is logged, drawn and refused."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.geometry import Box, Role
from pydrake.systems.analysis import InitializeParams

from cdpr_drake.analyses.reporting.log_files import column_names
from cdpr_drake.analyses.simulation.run_figures import run_figures
from cdpr_drake.analyses.simulation.visual_servo_run import make_simulator, run_scenario
from cdpr_drake.cli.app import main
from cdpr_drake.errors import ScenarioError
from cdpr_drake.geometry.poses import pose_from_row, pose_rows_distance, rotation_vector
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.loops.loop_choice import diagram_reason
from cdpr_drake.systems.monitoring.context_state import has_arrays_only, restore_state, state_arrays
from tests.messages import printed

QUICK = ("duration=0.3", "integration.engine=compiled", "log_rate=50")
NO_DEPTH = (*QUICK, "sensors.depth=null")
SAME_FRAMES = 1e-9


@pytest.fixture(scope="module")
def run():
    return run_scenario(load_scenario("acrobot_perception", QUICK))


def test_all_is_logged_with_its_units(run):
    names = column_names(run.log, [f"C{i}" for i in range(1, 9)], run.servo.feature_names)
    for column in (
        "scan_front.681_m", "scan_beam.0_m", "specific_force.z_m_s2", "angular_velocity.x_rad_s",
        "imu_biases.wz_rad_s", "depth_row.159_m", "pan_tilt_encoders.tilt_rad",
        "X_WO_odometry.qw", "wheel_distances.right_m",
    ):  # fmt: skip
        assert column in names


def test_each_has_its_own_rate(run):
    log = run.log
    for name, most in (("scan_front", 4), ("depth_row", 3), ("specific_force", 16)):
        changes = np.sum(np.any(log[name][1:] != log[name][:-1], axis=1))
        assert 1 <= changes <= most, name


def test_it_has_a_figure_of_each(run):
    drawn = run_figures(run)
    for name in ("scan_front", "scan_beam", "imu", "depth", "pan_tilt", "odometry"):
        assert f"{name}.png" in drawn
    assert run.depth_image.shape == (120, 160)
    assert "imu.png" not in run_figures(
        replace(run, servo=build_visual_servo(load_scenario("acrobot_moving_tag", QUICK)))
    )


def test_a_beam_on_the_head_ends_where_the_head_says():
    """Its end, by the head's angles, is on the surface of one of the frame's boxes."""
    servo = build_visual_servo(load_scenario("acrobot_perception", NO_DEPTH))
    context = servo.make_context()
    head, beam = servo.looking.pan_tilt, servo.looking.ranges["beam"]
    X_HS = servo.scenario.sensors.range_sensors[1].pose.transform()
    scene = servo.block.scene_graph
    query = scene.get_query_output_port().Eval(scene.GetMyContextFromRoot(context))
    inspector, met = query.inspector(), 0
    for pan in np.linspace(-1.0, 1.0, 41):
        angles = np.array([pan, -0.1])
        own = head.GetMyMutableContextFromRoot(context)
        own.SetDiscreteState(np.concatenate([angles, np.zeros(3)]))
        (found,) = beam.truth(beam.GetMyContextFromRoot(context))
        if np.isinf(found):
            continue
        X_WS = servo.true_pose(context) @ head.head(angles) @ X_HS
        end = X_WS @ np.array([found, 0.0, 0.0])
        outside = [
            np.max(
                np.abs(query.GetPoseInWorld(g).inverse() @ end) - inspector.GetShape(g).size() / 2
            )
            for g in inspector.GetAllGeometryIds(Role.kPerception)
            if isinstance(inspector.GetShape(g), Box)
        ]
        assert np.min(np.abs(outside)) < SAME_FRAMES
        met += 1
    assert met > 0


def test_what_moves_can_carry_a_sensor():
    """A beam on the mobile robot looks up at the platform: that is as high as the log says."""
    pose = "{position: [0.06, 0, 0], angles_deg: [0, -90, 0]}"
    up = f"sensors.range_sensors=[{{name: up, type: beam, carrier: target, pose: {pose}}}]"
    servo = build_visual_servo(load_scenario("acrobot_perception", [*NO_DEPTH, up]))
    context = servo.make_context()
    beam = servo.looking.ranges["up"]
    (found,) = beam.truth(beam.GetMyContextFromRoot(context))
    bottom = servo.true_pose(context).translation()[2]  # P is in the middle of the bottom face
    height = servo.motion.at(0.0).translation()[2]
    assert found == pytest.approx(bottom - height, abs=SAME_FRAMES)


def test_the_imu_reads_the_motion(run):
    """Without errors, the angular velocity is that of the log, and gravity is up on average."""
    log = run_scenario(
        load_scenario("acrobot_perception", [*NO_DEPTH, "sensors.imu.type=ideal",
                                             "sensors.imu.rate=50"])
    ).log  # fmt: skip
    poses = [pose_from_row(row) for row in log["X_WP"]]
    dt = log["time"][1] - log["time"][0]
    for k in range(3, 12):
        turn = rotation_vector(poses[k - 2].rotation().inverse() @ poses[k].rotation()) / (2 * dt)
        np.testing.assert_allclose(log["angular_velocity"][k], turn, atol=0.08)
    assert np.mean(log["specific_force"][:, 2]) == pytest.approx(9.81, abs=1.5)


def test_streams_are_independent():
    """A sensor more changes nothing of what the others read."""
    few = run_scenario(
        load_scenario("acrobot_perception", [*NO_DEPTH, "duration=0.1", "sensors.imu=null"])
    ).log
    more = run_scenario(load_scenario("acrobot_perception", [*NO_DEPTH, "duration=0.1"])).log
    np.testing.assert_array_equal(few["wheel_distances"], more["wheel_distances"])
    np.testing.assert_allclose(few["scan_front"][:4], more["scan_front"][:4], atol=1e-6)


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("sensors.imu.rate=300", "sensors.imu.rate: found 300; accepted: at most 200"),
        ("sensors.range_sensors=[{name: a}, {name: a}]", "range_sensors[1].name: found a twice"),
        ("sensors.pan_tilt=null", "range_sensors[1].carrier: found pan_tilt, which is not there"),
        ("sensors.pan_tilt.lower_deg=[80,0]", "pan_tilt.lower_deg: accepted: at most upper_deg"),
        ("sensors.depth.carrier=hose", "depth.carrier: found hose, which is not there; accepted"),
        ("target.motion=null", "sensors.odometry: found a target that no mobile robot carries"),
        ("sensors.range_sensors=[{name: a, type: hokuyu}]", "hokuyu"),
        ("sensors.depth.binning=0", "binning"),
    ],
)
def test_what_cannot_be_is_refused_by_name(override, words):
    with pytest.raises(ScenarioError) as problem:
        load_scenario("acrobot_perception", [override])
    assert words in str(problem.value)
    assert len(str(problem.value)) <= 500


def test_the_command_line_ends_with_2_and_writes_nothing(tmp_path, capsys):
    out = tmp_path / "run"
    override = "sensors.depth.rate=1000"
    with pytest.raises(SystemExit) as end:
        main(["simulate", "acrobot_perception", "--set", override, "--out", str(out)])
    assert end.value.code == 2
    assert "sensors.depth.rate: found 1000" in printed(capsys).err
    assert not out.exists()


def test_readings_oftener_than_steps_are_refused():
    scenario = load_scenario("acrobot_perception", [*NO_DEPTH, "integration.max_step=0.02"])
    with pytest.raises(ScenarioError, match=r"sensors\.range_sensors\[0\]|sensors\.imu\.rate"):
        build_visual_servo(replace(scenario, sensors=replace(scenario.sensors, range_sensors=[])))


def test_a_loop_without_a_diagram_leaves_it_to_a_diagram():
    scenario = load_scenario("acrobot_perception", NO_DEPTH)
    assert diagram_reason(scenario) == "its sensors look at a scene"


def test_odometry_is_right_at_the_start_and_drifts(run):
    motion = run.servo.motion
    start = np.array([motion.at(0.0).translation()])
    np.testing.assert_allclose(run.log["X_WO_odometry"][:1, 4:], start, atol=1e-12)
    distance, _ = pose_rows_distance(run.log["X_WO_odometry"][-1:], run.log["X_WO_odometry"][:1])
    assert distance[0] > 1e-3


def test_a_run_that_is_continued_reads_the_same():
    """Biases, odometry and the head are state; all that is random goes by the sample's number."""
    servo = build_visual_servo(load_scenario("acrobot_perception", [*NO_DEPTH, "duration=0.2"]))
    context = servo.make_context()
    simulator = make_simulator(servo, context)
    simulator.AdvanceTo(0.1)
    assert has_arrays_only(context)
    kept = {name: values.copy() for name, values in state_arrays(context).items()}
    simulator.AdvanceTo(0.2)
    again = servo.make_context()
    restore_state(again, kept)
    simulator = make_simulator(servo, again)
    params = InitializeParams()
    params.suppress_initialization_events = True
    simulator.Initialize(params)
    simulator.AdvanceTo(0.2)
    whole, part = servo.log.read(context), servo.log.read(again)
    for name, values in part.items():
        np.testing.assert_array_equal(whole[name][-len(values) + 1 :], values[1:], err_msg=name)
