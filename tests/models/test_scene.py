"""What stands around the platform: tags that a detector reads, frame and ground."""

import numpy as np
import pytest
from pydrake.geometry import Role
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.rendered_camera import add_renderer, make_rgbd_sensor
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.scene import GROUND_DEPTH, add_frame, add_ground, add_tag, plate_mesh
from cdpr_drake.vision.apriltags import TagFinder, tag_corners, tag_plate
from cdpr_drake.vision.pinhole import Pinhole

CORNER_OFFSET = 0.6
"""A detected corner [px] lies this near to its projection; measured 0.1 to 0.5 px."""

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
