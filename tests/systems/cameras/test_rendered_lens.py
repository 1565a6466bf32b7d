"""Rendered images through a lens, and spoiled ones: tags are where they are projected."""

import numpy as np
import pytest
from pydrake.multibody.math import SpatialVelocity

from cdpr_drake.errors import ScenarioError
from cdpr_drake.geometry.poses import exponential, pose_error
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo

CORNER_OFFSET = 0.6
"""Largest offset of one corner [px], that of rendered images without a lens."""

MEAN_OFFSET = 0.15
"""Mean over all corners [px]; without a lens 0.1 is held."""

BARREL = "camera.distortion={kind: brown_conrady, k1: -0.25, k2: 0.06, p1: 0.001, p2: -0.0008}"
FISHEYE = "camera.distortion={kind: fisheye, k1: -0.02, k2: 0.005}"
RENDERED = ["camera.kind=rendered"]


class Still:
    """A servo at its start, of which images can be taken with a velocity of the platform."""

    def __init__(self, *overrides, name="acrobot_pbvs"):
        self.servo = build_visual_servo(load_scenario(name, [*RENDERED, *overrides]))
        self.context = self.servo.make_context()
        self.block = self.servo.cable_robot
        self.camera = self.servo.diagram.GetSubsystemByName("camera")

    def place(self, X_WP, V_WP=None):
        """Puts the platform somewhere, with a twist in W."""
        plant = self.block.plant
        context = plant.GetMyMutableContextFromRoot(self.context)
        self.block.in_plant.set_pose(context, X_WP)
        if V_WP is not None:
            plant.SetFreeBodySpatialVelocity(context, self.block.in_plant.body, V_WP)

    def image(self):
        """The image of now, shape (height, width, 4)."""
        port = self.camera.GetOutputPort("color_image")
        return np.array(port.Eval(self.camera.GetMyContextFromRoot(self.context)).data)

    def expected(self, X_WP):
        """Where corners are in the image of a pose, shape (2, 4) [px]."""
        X_CO = self.servo.X_CO(X_WP, 0.0)
        return self.servo.pinhole.project(X_CO @ self.servo.target.points)


@pytest.mark.parametrize("lens", [BARREL, FISHEYE], ids=["barrel", "fisheye"])
def test_a_rendered_tag_is_where_the_lens_projects_it(lens):
    still = Still(lens)
    start = still.servo.scenario.initial_pose.transform()
    goal = still.servo.desired_platform_pose()
    offsets = []
    for X_WP in (start, goal):
        still.place(X_WP)
        found = still.servo.measurement.find_in(still.image())
        assert found is not None
        offsets.append(found.reshape(4, 2).T - still.expected(X_WP))
    assert np.max(np.abs(offsets)) < CORNER_OFFSET
    assert np.max(np.abs(np.mean(offsets, axis=(0, 2)))) < MEAN_OFFSET


def test_a_lens_that_is_ignored_bends_edges_of_a_large_tag():
    """Why pictures are straightened: lines that are fitted to bent edges meet off the corners."""
    still = Still(BARREL, "perturbations.camera_distortion={kind: none}")
    X_WP = still.servo.desired_platform_pose()
    still.place(X_WP)
    found = still.servo.measurement.find_in(still.image()).reshape(4, 2).T
    assert np.min(np.abs(found - still.expected(X_WP))) > 1.5


@pytest.mark.parametrize("name", ["acrobot_circles", "acrobot_pbvs_textured"])
def test_other_targets_are_found_through_a_lens(name):
    still = Still(BARREL, name=name)
    X_WP = still.servo.desired_platform_pose()
    still.place(X_WP)
    measurement = still.servo.measurement
    frames = measurement.next_frames(measurement.no_frames(), measurement.find_in(still.image()))
    assert frames[0] == 1.0
    place = still.servo.X_CO(X_WP, 0.0).translation()
    assert np.linalg.norm(measurement.pose_of(frames).translation() - place) < 1e-3


def test_a_rolling_shutter_shows_rows_at_their_times():
    """The tag moves in the image by ten pixels while it is read out; corners are as their rows."""
    readout = 0.03
    still = Still(f"camera.flaws={{readout: {readout}, renders: 24}}")
    X_WP = still.servo.desired_platform_pose()
    V_WP = SpatialVelocity([0.0, 0.0, 0.4], [0.03, 0.02, 0.0])
    still.place(X_WP, V_WP)
    found = still.servo.target.find(still.image()).reshape(4, 2).T
    R = X_WP.rotation().inverse()
    V_P = np.concatenate([R @ V_WP.rotational(), R @ V_WP.translational()])
    expected = np.empty((2, 4))
    for k in range(4):
        row = found[1, k]
        for _ in range(5):
            when = -readout * (1.0 - row / (still.servo.pinhole.height - 1))
            expected[:, k] = still.expected(X_WP @ exponential(V_P * when))[:, k]
            row = expected[1, k]
    at_once = still.expected(X_WP)
    assert np.max(np.abs(found - expected)) < CORNER_OFFSET
    assert np.max(np.abs(found - at_once)) > 3.0
    still.place(X_WP, SpatialVelocity(np.zeros(6)))
    resting = still.servo.target.find(still.image()).reshape(4, 2).T
    assert np.max(np.abs(resting - at_once)) < CORNER_OFFSET


def test_a_camera_in_the_world_sees_the_platform_where_it_was():
    still = Still("camera.flaws={exposure: 0.02, renders: 4}", name="acrobot_eye_to_hand")
    X_WP = still.servo.scenario.initial_pose.transform()
    v = np.array([0.2, 0.1, 0.0])
    still.place(X_WP, SpatialVelocity(np.zeros(3), v))
    found = still.servo.target.find(still.image()).reshape(4, 2).T
    X_WP_before = X_WP.__class__(X_WP.rotation(), X_WP.translation() - 0.01 * v)
    middle = still.expected(X_WP_before)
    assert np.max(np.abs(found - middle)) < 1.0
    assert np.max(np.abs(found - still.expected(X_WP))) > np.max(np.abs(found - middle))


def test_images_with_flaws_are_the_same_by_the_same_seed():
    flaws = "camera.flaws={noise: 3, defocus: 0.7}"
    one, same, other, clean = (
        Still(*more).image() for more in ((flaws,), (flaws,), (flaws, "seed=8"), ())
    )
    np.testing.assert_array_equal(one, same)
    assert np.any(one != other)
    assert np.any(one != clean)


def test_a_known_lens_gives_the_pose_of_a_rendered_tag():
    still = Still(BARREL)
    X_WP = still.servo.desired_platform_pose()
    still.place(X_WP)
    measurement = still.servo.measurement
    found = measurement.find_in(still.image())
    frames = measurement.next_frames(measurement.no_frames(), found)
    distance, angle = pose_error(measurement.pose_of(frames), still.servo.X_CO(X_WP, 0.0))
    assert distance < 1e-3
    assert angle < np.radians(0.6)


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["camera.kind=projected", "camera.flaws={noise: 1}"], "camera.flaws: found a section"),
        (["camera.region=target", "camera.flaws={noise: 1}"], "camera.flaws: found a section"),
        (["camera.flaws={readout: 0.05}"], "camera.flaws: found exposure and readout of 0.05 s"),
    ],
)
def test_flaws_that_no_image_has_are_refused(overrides, words):
    with pytest.raises(ScenarioError, match=words):
        load_scenario("acrobot_pbvs", [*RENDERED, *overrides])
