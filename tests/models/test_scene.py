"""What stands around the platform, and a rendered camera that sees it as a projected one does."""

import os
import time

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.geometry import Role, SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantValueSource

from cdpr_drake.errors import RenderingError
from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.models import rendered_camera
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.rendered_camera import (
    add_renderer,
    check_rendering,
    make_rgbd_sensor,
    probe_rendering,
)
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.scene import GROUND_DEPTH, add_frame, add_ground, add_tag, plate_mesh
from cdpr_drake.servoing.servo_task import CameraMounting
from cdpr_drake.systems.cameras.projected_camera import ProjectedCamera
from cdpr_drake.systems.cameras.target_measurement import TargetDetector
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.vision.apriltags import TagFinder, TagTarget, tag_corners, tag_plate
from cdpr_drake.vision.pinhole import Pinhole

CORNER_OFFSET = 0.6
"""A detected corner [px] lies this near to its projection; measured 0.1 to 0.5 px: what OpenCV's
refinement leaves on tags of 60 to 700 px."""

ROUND_OFF = 1e-12
"""Sums of a few lengths of order one [m]."""

PINHOLE = Pinhole.from_view_angles(320, 240, np.radians(60.0), np.radians(46.8))

X_WC = pose_from_angles(np.array([0.0, 0.0, 0.5]), np.array([np.pi, 0.0, 0.0]))
"""A camera half a metre above the ground that looks down; its x is that of the world."""


class Scene:
    """A plant with a scene, to be filled, and a camera at X_WC."""

    def __init__(self):
        self._builder = DiagramBuilder()
        self.plant, self.scene_graph = AddMultibodyPlantSceneGraph(self._builder, 0.0)

    def image(self, set_up=None):
        """The camera's colour image, shape (240, 320, 4); `set_up(plant_context)` comes first."""
        self.plant.Finalize()
        add_renderer(self.scene_graph)
        camera = self._builder.AddSystem(
            make_rgbd_sensor(self.scene_graph.world_frame_id(), X_WC, PINHOLE)
        )
        self._builder.Connect(
            self.scene_graph.get_query_output_port(), camera.query_object_input_port()
        )
        diagram = self._builder.Build()
        context = diagram.CreateDefaultContext()
        if set_up is not None:
            set_up(self.plant.GetMyMutableContextFromRoot(context))
        port = camera.color_image_output_port()
        return port.Eval(camera.GetMyContextFromRoot(context)).data

    def names(self, body):
        """Names of the geometries that show a body."""
        inspector = self.scene_graph.model_inspector()
        return [inspector.GetName(g) for g in self.plant.GetVisualGeometriesForBody(body)]


def projected_corners(X_WO, size):
    """Corners of a tag in the image of the camera, by the pinhole model, shape (2, 4) [px]."""
    return PINHOLE.project((X_WC.inverse() @ X_WO).multiply(tag_corners(size)))


def test_two_tags_are_found_at_their_places_by_their_identities():
    poses = {
        4: pose_from_angles(np.array([-0.13, 0.02, 0.0]), np.array([0.0, 0.0, 0.4])),
        586: pose_from_angles(np.array([0.12, -0.03, 0.0]), np.array([0.2, -0.1, -1.2])),
    }
    scene = Scene()
    for tag_id, X_WO in poses.items():
        add_tag(scene.plant, tag_id, 0.1, X_WO)
    assert scene.names(scene.plant.world_body()) == ["tag_4_on_world", "tag_586_on_world"]
    image = scene.image()
    for tag_id, X_WO in poses.items():
        corners = TagFinder([tag_id]).find(image)[tag_id]
        offset = np.linalg.norm(corners - projected_corners(X_WO, 0.1), axis=0)
        assert np.all(offset < CORNER_OFFSET)
    assert not TagFinder([5]).find(image)


def test_a_tag_moves_with_its_body():
    scene = Scene()
    body = scene.plant.AddRigidBody("plate", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    X_BO = pose_from_angles(np.array([0.03, 0.02, 0.01]), np.array([0.0, 0.1, 0.5]))
    X_WB = pose_from_angles(np.array([0.05, -0.06, 0.1]), np.array([0.1, 0.0, 1.0]))
    add_tag(scene.plant, 7, 0.08, X_BO, body)
    assert scene.names(body) == ["tag_7_on_plate"]
    image = scene.image(lambda context: scene.plant.SetFreeBodyPose(context, body, X_WB))
    corners = TagFinder([7]).find(image)[7]
    offset = np.linalg.norm(corners - projected_corners(X_WB @ X_BO, 0.08), axis=0)
    assert np.all(offset < CORNER_OFFSET)


def test_a_tag_that_looks_away_is_not_read():
    """Its back shows the picture in a mirror, which is no tag."""
    scene = Scene()
    add_tag(scene.plant, 0, 0.1, pose_from_angles(np.zeros(3), np.array([np.pi, 0.0, 0.0])))
    assert not TagFinder([0]).find(scene.image())


def test_a_tag_on_the_floor_is_not_hidden_by_the_ground():
    scene = Scene()
    robot = load_robot("acrobot_small")
    add_ground(scene.plant, robot)
    add_frame(scene.plant, robot)
    add_tag(scene.plant, 3, 0.1, RigidTransform())
    assert 3 in TagFinder([3]).find(scene.image())


def test_the_picture_s_black_square_has_the_asked_size():
    """The plate's edge is a quarter longer than the tag, by the white rim."""
    for tag_id, size in ((0, 0.2), (17, 0.06)):
        plate = tag_plate(tag_id, size, RigidTransform())
        shape = plate_mesh(plate.png, plate.width)
        obj = shape.source().in_memory().mesh_file.contents().decode()
        vertices = np.array([line.split()[1:] for line in obj.splitlines() if line[:2] == "v "])
        edges = np.ptp(vertices.astype(float), axis=0)
        np.testing.assert_allclose(edges, [1.25 * size, 1.25 * size, 0.0], atol=ROUND_OFF)


@pytest.mark.parametrize("name", ["acrobot_small", "caroca"])
def test_frame_is_twelve_beams_around_its_box(name):
    robot = load_robot(name)
    scene = Scene()
    add_frame(scene.plant, robot)
    world = scene.plant.world_body()
    expected = {f"{name}_beam_{axis}{number}" for axis in "xyz" for number in range(4)}
    assert set(scene.names(world)) == expected
    inspector = scene.scene_graph.model_inspector()
    lower, upper = np.full(3, np.inf), np.full(3, -np.inf)
    for geometry in scene.plant.GetVisualGeometriesForBody(world):
        middle = inspector.GetPoseInFrame(geometry).translation()
        half = np.array(inspector.GetShape(geometry).size()) / 2.0
        lower, upper = np.minimum(lower, middle - half), np.maximum(upper, middle + half)
    # The beams' middle lines are the edges of the box.
    half_beam = robot.frame.beam_width() / 2.0
    np.testing.assert_allclose(lower, robot.frame.lower - half_beam, atol=ROUND_OFF)
    np.testing.assert_allclose(upper, robot.frame.upper + half_beam, atol=ROUND_OFF)


def test_ground_lies_just_below_zero_and_under_the_frame():
    robot = load_robot("caroca")
    scene = Scene()
    add_ground(scene.plant, robot)
    (geometry,) = scene.plant.GetVisualGeometriesForBody(scene.plant.world_body())
    inspector = scene.scene_graph.model_inspector()
    middle = inspector.GetPoseInFrame(geometry).translation()
    half = np.array(inspector.GetShape(geometry).size()) / 2.0
    assert (middle + half)[2] == pytest.approx(-GROUND_DEPTH, abs=ROUND_OFF)
    assert np.all((middle - half)[:2] < robot.frame.lower[:2])
    assert np.all((middle + half)[:2] > robot.frame.upper[:2])


def test_nothing_of_the_scene_collides():
    scene = Scene()
    robot = load_robot("acrobot_small")
    add_ground(scene.plant, robot)
    add_frame(scene.plant, robot)
    add_tag(scene.plant, 0, 0.1, RigidTransform())
    inspector = scene.scene_graph.model_inspector()
    assert inspector.NumGeometriesWithRole(Role.kProximity) == 0
    assert inspector.NumGeometriesWithRole(Role.kPerception) == 13  # the floor is for the browser


# A rendered camera.

MEAN_OFFSET = 0.1
"""Mean over all corners of all poses [px]. Drake and OpenCV count pixels from different places,
which would show as half a pixel."""

POSE_DISTANCE = 1.0e-3
"""Distance of X_CO [m] that follows from the corners' offsets on a tag of 70 px at 0.28 m:
0.6 px of 70 px would be 0.9 % of the distance at the worst, 2.4 mm; measured up to 0.6 mm."""

POSE_ANGLE = np.radians(0.6)
"""Angle of X_CO; about twice the largest that was measured on 20 poses."""

TAG_SIZE = 0.06
X_WO = RigidTransform([0.2209, -0.197, 0.0])

START = np.array([0.112, -0.032, 0.301, -12.0, -10.0, 0.0])
END = np.array([0.284, -0.197, 0.08, 0.0, 0.0, 0.0])
"""Poses of the platform of servoing thesis 2.3.2, case study I [m, deg]."""


class TwoCameras:
    """ACROBOT's small platform with a rendered and a projected camera in the same place."""

    def __init__(self, width, height):
        robot = load_robot("acrobot_small")
        X_PC = robot.camera_mount("onboard").pose.transform()
        pinhole = load_camera("ids_kowa").pinhole(width, height)
        builder = DiagramBuilder()
        self.robot = builder.AddSystem(CableRobot(robot, add_to_scene=self._add_tag))
        add_renderer(self.robot.scene_graph)
        platform = self.robot.in_plant.body
        frame = self.robot.plant.GetBodyFrameIdOrThrow(platform.index())
        sensor = builder.AddSystem(make_rgbd_sensor(frame, X_PC, pinhole))
        tag = TagTarget(0, TAG_SIZE)
        self.rendered = builder.AddSystem(TargetDetector(tag, pinhole, 25.0))
        self.projected = builder.AddSystem(
            ProjectedCamera(tag, CameraMounting(X_PC), pinhole, 25.0)
        )
        place = builder.AddSystem(ConstantValueSource(Value(X_WO)))
        for source, user in (
            (self.robot.GetOutputPort("query_object"), sensor.query_object_input_port()),
            (sensor.color_image_output_port(), self.rendered.GetInputPort("color_image")),
            (self.robot.GetOutputPort("X_WP"), self.projected.GetInputPort("X_WP")),
            (place.get_output_port(), self.projected.GetInputPort("X_WO")),
        ):
            builder.Connect(source, user)
        self.diagram = builder.Build()

    @staticmethod
    def _add_tag(builder, robot, scene_graph):
        add_tag(robot.plant, 0, TAG_SIZE, X_WO)

    def look(self, pose):
        """What rendered and projected camera measure with the platform at (x, y, z, angles)."""
        X_WP = pose_from_angles(pose[:3], np.radians(pose[3:]))
        simulator = Simulator(self.diagram)
        context = simulator.get_mutable_context()
        own = self.robot.GetMyMutableContextFromRoot(context)
        self.robot.set_at_equilibrium(own, X_WP)
        self.robot.GetInputPort("cable_velocities").FixValue(own, np.zeros(8))
        simulator.AdvancePendingEvents()
        return [
            [
                camera.GetOutputPort(name).Eval(camera.GetMyContextFromRoot(context))
                for name in ("found", "corners", "X_CO")
            ]
            for camera in (self.rendered, self.projected)
        ]


@pytest.mark.parametrize(("width", "height", "count"), [(640, 480, 6), (1600, 1200, 1)])
def test_rendered_and_projected_camera_agree(width, height, count):
    """On the way of case study I, with some turns added, so that no pose is special."""
    cameras = TwoCameras(width, height)
    random = np.random.default_rng(3)
    offsets = []
    for share in np.linspace(0.0, 1.0, count):
        pose = (1.0 - share) * START + share * END
        pose[3:] += random.uniform(-1.0, 1.0, 3)
        rendered, projected = cameras.look(pose)
        assert rendered[0] == projected[0] == 1.0
        offsets.append((rendered[1] - projected[1]).reshape(4, 2))
        distance, angle = pose_error(rendered[2], projected[2])
        assert distance < POSE_DISTANCE
        assert angle < POSE_ANGLE
    assert np.all(np.linalg.norm(offsets, axis=2) < CORNER_OFFSET)
    assert np.all(np.abs(np.mean(offsets, axis=(0, 1))) < MEAN_OFFSET)


def test_sensor_has_the_pinhole_s_parameters():
    """Drake counts the principal point from the image's corner, `Pinhole` from a pixel's middle."""
    pinhole = load_camera("ids_kowa").pinhole(320, 240)
    sensor = make_rgbd_sensor(SceneGraph.world_frame_id(), RigidTransform(), pinhole)
    for camera in (sensor.default_color_render_camera(), sensor.default_depth_render_camera()):
        info = camera.core().intrinsics()
        assert (info.width(), info.height()) == (320, 240)
        assert (info.focal_x(), info.focal_y()) == (pinhole.fx, pinhole.fy)
        assert (info.center_x(), info.center_y()) == (160.0, 120.0)


def test_a_scene_gets_one_renderer():
    scene_graph = SceneGraph()
    add_renderer(scene_graph)
    add_renderer(scene_graph)
    assert scene_graph.RendererCount() == 1
    assert scene_graph.HasRenderer(rendered_camera.RENDERER)


@pytest.mark.parametrize(
    ("missing", "package"), [("libEGL.so.1", "libegl1"), ("libGL.so.1", "libgl1")]
)
def test_a_missing_library_is_named_with_its_package_and_the_way_around(
    monkeypatch, missing, package
):
    def load(library):
        if library == missing:
            raise OSError(f"{library}: cannot open shared object file")

    monkeypatch.setattr(rendered_camera, "CDLL", load)
    for start in (check_rendering, lambda: add_renderer(SceneGraph())):
        with pytest.raises(RenderingError) as caught:
            start()
        message = str(caught.value)
        assert missing in message
        assert f"package {package} " in message
        assert "camera.kind=projected" in message
        assert "\n" not in message


def test_rendering_works_where_these_tests_run():
    check_rendering()


def test_a_driver_that_ends_the_process_is_one_line_with_the_way_around(monkeypatch):
    monkeypatch.setattr(rendered_camera, "_state", rendered_camera._State(has_renderer=True))
    crash = "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)"
    monkeypatch.setattr(rendered_camera, "_PROBE_PROGRAM", crash)
    for _ in range(2):  # nothing is kept of a failure
        with pytest.raises(RenderingError, match=r"by SIGSEGV.*camera.kind=projected") as caught:
            probe_rendering()
        assert "\n" not in str(caught.value)


def test_a_driver_that_hangs_is_one_line(monkeypatch):
    monkeypatch.setattr(rendered_camera, "_state", rendered_camera._State(has_renderer=True))
    monkeypatch.setattr(rendered_camera, "_PROBE_PROGRAM", "import time; time.sleep(60)")
    monkeypatch.setattr(rendered_camera, "PROBE_TIMEOUT", 0.2)
    with pytest.raises(RenderingError, match=r"no image within 0\.2 s.*camera.kind=projected"):
        probe_rendering()


def test_a_copy_that_fails_is_not_believed(monkeypatch):
    """A process with threads may break its copy; only a new process proves that rendering does."""
    monkeypatch.setattr(rendered_camera, "_state", rendered_camera._State())
    monkeypatch.setattr(rendered_camera, "_copy_renders", lambda: False)
    probe_rendering()
    assert rendered_camera._state.works


def test_a_copy_that_crashes_or_draws_is_told_apart(monkeypatch):
    monkeypatch.setattr(rendered_camera, "render_once", lambda: None)
    assert rendered_camera._copy_renders()
    monkeypatch.setattr(rendered_camera, "render_once", lambda: os.kill(os.getpid(), 9))
    assert not rendered_camera._copy_renders()
    monkeypatch.setattr(rendered_camera, "render_once", lambda: time.sleep(60))
    monkeypatch.setattr(rendered_camera, "COPY_TIMEOUT", 0.1)
    assert not rendered_camera._copy_renders()
