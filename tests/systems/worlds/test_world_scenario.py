"""The section `world` of scenarios: what is refused, engines and loops, and whole runs."""

import struct
from importlib.resources import files

import numpy as np
import pytest
from pydrake.geometry import Role

from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.runs.subjects import world_facts
from cdpr_drake.analyses.runs.tension import TensionRun
from cdpr_drake.analyses.templates import file_schema
from cdpr_drake.analyses.visualization.replay import RobotPicture
from cdpr_drake.errors import ScenarioError
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.loops.loop_choice import diagram_reason, set_loop
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.files import scenario_names
from cdpr_drake.systems.scenarios.run_settings import engine_of, has_contact
from cdpr_drake.systems.sensors.scene_shapes import SceneShapes

TABLE = 0.1
"""Height of the table of acrobot_set_down [m]."""

RESTS = 1e-3
"""How near to the table's top a platform that was set down has to be [m], by the issue."""

STILL = 2e-5
"""By how much it may move within a tenth of a second, once it rests [m]: what sticks creeps."""

CHATTER = 1.05
"""Ups and downs of a tension from the first touch on, of what it was then: 1 if it only falls."""

SHORT = (
    "initial_pose={position: [0.0, 0.0, 0.115]}",
    "open_loop.waypoints=[{pose: {position: [0.0, 0.0, 0.085]}, duration: 0.4}]",
    "target.size=0.006", "stop.hold=0.25", "log_rate=1000",
)  # fmt: skip
"""acrobot_set_down from a lower start, at the same speed."""


def set_down_with(*overrides):
    return ServoRun(load_scenario("acrobot_set_down", [*SHORT, *overrides])).simulate()


@pytest.fixture(scope="module")
def set_down():
    return set_down_with()


def test_a_platform_that_is_set_down_rests_on_the_table_and_stays(set_down):
    log = set_down.log
    assert set_down.outcome == Outcome.COMPLETED
    np.testing.assert_allclose(log["X_WP"][-1, 4:], [0.0, 0.0, TABLE], atol=RESTS)
    last = log["X_WP"][log["time"] > log["time"][-1] - 0.1, 4:]
    assert np.max(np.ptp(last, axis=0)) < STILL
    np.testing.assert_allclose(log["contact_force"][-1], [0.0, 0.0, 3.5 * 9.81], atol=0.01)
    assert log["contact_count"][-1, 0] == 4.0


def test_its_tensions_go_to_zero_without_chatter(set_down):
    log = set_down.log
    touched = int(np.argmax(log["contact_count"][:, 0] > 0.0))
    tensions = log["tensions"][touched:]
    assert np.all(tensions[-1] == 0.0)
    ups_and_downs = np.sum(np.abs(np.diff(tensions, axis=0)), axis=0)
    assert np.all(ups_and_downs < CHATTER * tensions[0] + 0.1)
    changes = np.count_nonzero(np.diff((tensions > 0.0).astype(int), axis=0), axis=0)
    assert np.all(changes == 1)  # slack once, slack for good


def test_clearances_of_the_run_are_those_of_its_poses(set_down):
    log, measure = set_down.log, set_down.built.meters.clearances
    for k in (0, 100, -1):
        X_WP, time = pose_from_row(log["X_WP"][k]), float(log["time"][k])
        np.testing.assert_array_equal(log["clearance"][k], measure.platform(X_WP, time))
        np.testing.assert_array_equal(log["cable_clearance"][k], measure.cables(X_WP, time))
        assert log["clearance"][k, 1] == pytest.approx(X_WP.translation()[2] - TABLE, abs=1e-6)


def test_summary_log_and_figures_tell_of_the_world(set_down):
    summary = set_down.as_dict()
    world = summary["world"]
    assert world["bodies"] == ["ground", "table"]
    assert world["least_clearance_m"]["table"] == pytest.approx(-1e-4, abs=2e-4)
    assert world["contact"]["model"] == "point"
    assert world["contact"]["final_force_n"] == pytest.approx(3.5 * 9.81, abs=0.01)
    assert "plant" in world["contact"]["engine"]
    assert summary["engine"] == "plant"
    assert "pass through" in world["cables"]
    assert dict(set_down.facts(summary))["contact"].startswith("from 0.")
    header = ",".join(set_down.columns())
    assert "clearance.ground_m,clearance.table_m,cable_clearance.ground_m" in header
    assert "contact_force.z_n,contact_count.count" in header
    set_down.plot("world")


def test_the_first_touch_ends_a_run_that_asks_for_it():
    passing = ("world.contact=null", "integration.engine=compiled")
    result, early = (set_down_with("stop.contact=true", *more) for more in ((), passing))
    assert result.outcome == early.outcome == Outcome.CONTACT
    assert result.log["X_WP"][-1, 6] == pytest.approx(TABLE, abs=RESTS)
    assert early.sim_time == pytest.approx(result.sim_time, abs=2e-3)


def test_without_contact_the_platform_passes_through_by_both_engines():
    ends = []
    for engine in ("plant", "compiled"):
        result = set_down_with("world.contact=null", f"integration.engine={engine}")
        assert result.outcome == Outcome.COMPLETED
        assert "contact_force" not in result.log
        ends.append(result.log["clearance"][-1])
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-5)
    assert ends[0][1] == pytest.approx(-0.015, abs=1e-3)


def test_automatic_takes_the_plant_for_contact():
    scenario = load_scenario("acrobot_set_down", ["duration=1e4"])
    for repeated in (False, True):
        chosen, words = set_loop(scenario, repeated)
        assert engine_of(chosen) == "plant"
        assert "its world has contact" in words
    assert diagram_reason(scenario) == "its world has contact"
    with pytest.raises(ScenarioError, match=r"integration.loop.*its world has contact"):
        set_loop(load_scenario("acrobot_set_down", ["integration.loop=compiled"]))


def ball(motion):
    return f"{{name: a, kind: sphere, radius: 0.1, motion: {{{motion}}}}}"


BODIES = {
    "size: found null; accepted: a value, for kind box": "{name: a, kind: box}",
    "size: found one of a sphere": "{name: a, kind: sphere, size: [1, 1, 1]}",
    "radius: found -1; accepted: a number >= 0.0001": "{name: a, kind: sphere, radius: -1}",
    r"motion.joint.point\[2\]: found 2e3; accepted: 3 numbers >= -1000 and <= 1000 \[m\]": ball(
        "joint: {point: [0, 0, 2e3], axis: [0, 0, 1]}"
    ),
    "kind: found cone; accepted: one of box, cylinder": "{name: a, kind: cone}",
    "name: found target; accepted: not one of": "{name: target, kind: sphere, radius: 0.1}",
    "name: found ground; accepted: not one of": "{name: ground, kind: sphere, radius: 0.1}",
    r"obstacles\[0\].file: .*no.obj: there is no such": "{name: a, kind: mesh, file: no.obj}",
    "accepted: a file .obj or .gltf": "{name: a, kind: mesh, file: no.stl}",
    "motion: found a velocity and a joint; accepted: one of them": ball(
        "velocity: [1, 0, 0], joint: {point: [0, 0, 0], axis: [0, 0, 1]}"
    ),
    r"found the times \[2.0, 1.0\]; accepted: growing": ball(
        "waypoints: [{time: 2, pose: {position: [1, 0, 0]}}, "
        "{time: 1, pose: {position: [1, 0, 0]}}]"
    ),
    "repeat: found true, but the last waypoint": ball(
        "repeat: true, waypoints: [{time: 2, pose: {position: [1, 0, 0]}}]"
    ),
    r"joint.axis: found \[0, 0, 0\]; accepted: 3 numbers, not all zero": ball(
        "joint: {point: [0, 0, 0], axis: [0, 0, 0]}"
    ),
    "starts 400 mm deep in a": "{name: a, kind: sphere, radius: 0.4}",
}
"""Words of the refusal, and a body that has no place of its own."""

PLACE = "{pose: {position: [0.0, 0.0, 0.25]}, name"
REFUSALS = {
    **{
        words: ("acrobot_set_down", [f"world.obstacles=[{body.replace('{name', PLACE, 1)}]"])
        for words, body in BODIES.items()
    },
    r"integration.engine: found compiled.*world.contact": (
        "acrobot_set_down", ["integration.engine=compiled"]
    ),
    r"stop\.contact: found true without a world": (
        "acrobot_set_down", ["stop.contact=true", "world=null"]
    ),
    r"stop\.contact: found true without a worl": ("acrobot_computed_torque", ["stop.contact=true"]),
}  # fmt: skip


@pytest.mark.parametrize("words", REFUSALS)
def test_what_cannot_be_is_refused_by_key(words):
    with pytest.raises(ScenarioError, match=words) as problem:
        load_scenario(*REFUSALS[words])
    assert all(len(line) <= 500 for line in str(problem.value).split("\n"))


def test_files_are_found_beside_the_scenario(tmp_path):
    (tmp_path / "thing.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
    )
    source = files("cdpr_drake.systems.scenarios").joinpath("acrobot_set_down.yaml").read_text()
    body = "{name: thing, kind: mesh, file: thing.obj, pose: {position: [2.0, 0.0, 0.0]}}"
    table = next(line for line in source.splitlines() if "name: table" in line)
    (tmp_path / "mine.yaml").write_text(source.replace(table, f"    - {body}"))
    scenario = load_scenario(str(tmp_path / "mine.yaml"))
    assert scenario.world.obstacles[0].file == str(tmp_path / "thing.obj")


@pytest.fixture(scope="module")
def gazebo():
    """The world of the Gazebo thesis."""
    return build_visual_servo(load_scenario("caroca_world", ["camera.kind=projected"]))


def test_the_world_of_the_gazebo_thesis_stands_where_it_says(gazebo):
    assert not has_contact(gazebo.scenario)
    world = gazebo.world.world
    assert world.names() == ["ground", "barrier_a", "barrier_b", "hose"]
    np.testing.assert_array_equal(world.body("barrier_a").motion.at(0.0).translation(), [2, 0, 0])
    X_WB = world.body("barrier_b").motion.at(0.0)
    np.testing.assert_array_equal(X_WB.translation(), [0, 2, 0])
    turned = X_WB.rotation().matrix()[:2, 0]
    np.testing.assert_allclose(turned, [np.cos(1.2), np.sin(1.2)], atol=1e-9)
    hose, later = (world.body("hose").motion.at(time) for time in (0.0, 0.7))
    axis = hose.rotation().matrix()[:, 2]
    np.testing.assert_allclose(axis, [np.sin(45.0), 0.0, np.cos(45.0)], atol=1e-9)
    top = np.array([0.0, 0.0, 1.0])
    np.testing.assert_allclose(hose @ top, later @ top, atol=1e-4)
    assert "acrobot_set_down" in scenario_names()


def test_the_hokuyo_on_the_hose_looks_down_on_the_ground(gazebo):
    """At the start its plane stands upright, and its middle beam looks straight down."""
    sensor, context = gazebo.diagram.GetSubsystemByName("scan_hokuyo"), gazebo.make_context()
    own = sensor.GetMyContextFromRoot(context)
    X_BS = gazebo.scenario.sensors.range_sensors[0].pose.transform()
    X_WS = gazebo.world.world.body("hose").motion.at(0.0) @ X_BS
    down = np.array([0.0, 0.0, -1.0])
    np.testing.assert_allclose(X_WS.rotation().matrix()[:, 0], down, atol=1e-9)
    query = sensor.GetInputPort("query_object").Eval(own)
    shapes = SceneShapes("perception")
    ((distance,), (met,)) = shapes.cast(query, X_WS.translation(), down[np.newaxis])
    assert query.inspector().GetName(met) == "world_ground"
    assert distance == pytest.approx(X_WS.translation()[2] + 1e-3, abs=1e-9)


def test_the_scene_shows_every_body(gazebo):
    inspector = gazebo.cable_robot.scene_graph.model_inspector()
    seen = {inspector.GetName(k) for k in inspector.GetAllGeometryIds(Role.kPerception)}
    shown = {inspector.GetName(k) for k in inspector.GetAllGeometryIds(Role.kIllustration)}
    bodies = {"world_barrier_a", "world_barrier_a_2", "world_barrier_b", "world_ground", "hose"}
    assert bodies <= seen & shown


def packed_matrix(packed):
    """The matrix of a transform as Meshcat packs it: 16 times a mark and 8 bytes, by columns."""
    numbers = packed[packed.index(b"matrix") :]
    numbers = numbers[numbers.index(b"\xcb") :][: 16 * 9]
    values = [struct.unpack(">d", numbers[9 * k + 1 : 9 * k + 9])[0] for k in range(16)]
    return np.reshape(values, (4, 4)).T


def test_browsers_and_replays_show_obstacles_where_they_are(gazebo):
    scenario = gazebo.scenario
    picture = RobotPicture(load_robot("caroca"), 100.0, scenario)
    for time in (0.0, 1.0):
        picture.draw(scenario.initial_pose.transform(), np.zeros(8), time)
        for path in ("world_barrier_a", "world_barrier_b_1", "world_ground", "hose/hose"):
            assert picture.meshcat.HasPath(f"visualizer/{path}")
        packed = picture.meshcat._GetPackedTransform("visualizer/hose")
        X_WB = scenario.world.obstacles[2].path().at(time).GetAsMatrix4()
        np.testing.assert_allclose(packed_matrix(packed), X_WB, atol=1e-9)


def test_cameras_see_obstacles_where_they_are():
    red_ball = (
        "world={obstacles: [{name: ball, kind: sphere, radius: 0.02, color: [1, 0, 0], "
        "pose: {position: [-0.03, 0.05, 0.08]}, motion: {velocity: [-0.05, 0, 0]}}]}"
    )
    overrides = [red_ball, "camera.kind=rendered", "target.size=0.02"]
    servo = build_visual_servo(load_scenario("acrobot_set_down", overrides))
    context = servo.make_context()
    X_WC = servo.mounting.X_WC(servo.true_pose(context))
    camera = servo.diagram.GetSubsystemByName("camera")
    for time in (0.0, 1.0):
        context.SetTime(time)
        image = camera.GetOutputPort("color_image").Eval(camera.GetMyContextFromRoot(context))
        p_WBall = np.array([-0.03 - 0.05 * time, 0.05, 0.08])
        u, v = servo.pinhole.project((X_WC.inverse() @ p_WBall)[:, None])[:, 0]
        red, green, blue, _ = image.data[round(v), round(u)]
        assert red > 150
        assert max(green, blue) < 60


def test_a_platform_is_set_down_on_ground_that_is_level_with_the_frame():
    """The ground gives way, and the platform is a little below its frame then."""
    lower = [word.replace("0.115", "0.012").replace("0.085", "-0.01") for word in SHORT]
    target = "target.pose={position: [-0.0631, 0.0, 0.0005]}"
    result = set_down_with(*lower, "world.obstacles=[]", target)
    assert result.outcome == Outcome.COMPLETED
    assert -RESTS < result.log["X_WP"][-1, 6] < 0.0
    with pytest.raises(ScenarioError, match="outside the frame"):
        load_scenario("acrobot_set_down", [*lower, "world=null"])


def test_schemas_know_the_world():
    schema, parts = file_schema("scenario").schema, []
    while "then" in schema:
        parts.append(schema["then"])
        schema = schema["else"]
    robots = [part for part in (*parts, schema) if "robot" in part["properties"]]
    assert len(robots) == 3
    for part in robots:
        assert "obstacles" in part["properties"]["world"]["anyOf"][0]["properties"]


def tension_scenario(*overrides, height=0.12):
    stretch = f"[{{pose: {{position: [0.0, 0.0, {height}]}}, duration: 0.4}}]"
    moves = [f"trajectory.stretches={stretch}", "trajectory.pause=0.0", "duration=0.4"]
    return load_scenario("acrobot_computed_torque", [*moves, "log_rate=50", *overrides])


@pytest.mark.parametrize("engine", ["plant", "compiled"])
def test_dynamic_control_measures_clearances_by_both_engines(engine):
    wall = (
        "world={obstacles: [{name: wall, kind: box, size: [0.02, 0.4, 0.4], "
        "pose: {position: [0.3, 0.0, 0.2]}}]}"
    )
    run = TensionRun(tension_scenario(wall, f"integration.engine={engine}")).simulate()
    assert run.outcome == Outcome.COMPLETED
    half = 0.5 * run.built.robot.platform.size[0]
    np.testing.assert_allclose(run.log["clearance"][:, 0], 0.29 - half, atol=1e-5)


def test_dynamic_control_meets_the_ground():
    def low(*overrides):
        ground = "world={ground: {height: 0.15}, contact: {}}"
        return tension_scenario(ground, *overrides, height=0.05)

    run = TensionRun(low()).simulate()
    assert run.outcome == Outcome.COMPLETED
    assert run.log["X_WP"][-1, 6] == pytest.approx(0.15, abs=RESTS)
    assert run.log["contact_count"][-1, 0] > 0.0
    warning, limits = TensionRun(low()).check()
    assert "replace tension_bounds" in limits
    assert "integration.max_step: found 0.001; the largest stable one" in warning
    assert TensionRun(low("integration.max_step=1e-4")).check() == [limits]
    facts = dict(run.facts(run.as_dict()))
    assert "from ground" in facts["least clearance"]
    assert TensionRun(low("stop.contact=true")).simulate().outcome == Outcome.CONTACT


@pytest.mark.parametrize(("gap", "passes"), [(-1e-3, True), (1e-3, False), (None, False)])
def test_cables_that_pass_through_a_body_are_told(gap, passes):
    """The table of acrobot_table_edge stood in the way of a cable, which one number told."""
    least = {"least_clearance_m": {"table": 0.0}, "least_cable_clearance_m": {"table": gap}}
    facts = dict(world_facts({"world": {**least, "contact": None}}))
    assert (facts.get("cables") == "pass through table, without contact") == passes
