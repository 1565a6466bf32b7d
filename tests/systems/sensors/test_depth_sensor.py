"""Rendered depth against rays that are cast on the same scene, and the noise of a sensor."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.geometry import Box, Capsule, Cylinder, Sphere
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import ImageDepth32F

from cdpr_drake.models.rendered_camera import add_renderer, make_depth_camera
from cdpr_drake.models.sensor_catalogue import load_depth_sensor
from cdpr_drake.sections.perception.depth_sensor import (
    DepthSensor,
    binned,
    depth_pinhole,
)
from cdpr_drake.systems.sensors.scene_shapes import SceneShapes
from tests.systems.sensors.scenes import scene_of

FLAT = 2e-6
"""Metres, of flat things up to 6 m away: depth is rendered in single precision."""

ROUND = 3e-3
"""Metres: round things are rendered as polygons, of which those of a ball of 0.3 m are 0.6 mm too
deep, and more where rays graze them."""

IDEAL = replace(binned(load_depth_sensor("ideal"), 8), limits=np.array([0.3, 6.0]))
X_WC = RigidTransform(RollPitchYaw(-np.pi / 2 - 0.2, 0.0, -np.pi / 2), np.array([0.0, 0.0, 1.0]))
"""Looks along x of W, slightly down."""


def pictures():
    """The rendered depth and the one from rays [m], and what is flat, shape (h, w)."""
    shapes = [
        (Box(0.1, 9.0, 9.0), RigidTransform([4.0, 0, 0])),
        (Box(0.5, 0.6, 0.7), RigidTransform(RollPitchYaw(0.3, 0.4, 0.5), [2.0, 0.6, 0.9])),
        (Sphere(0.3), RigidTransform([1.5, -0.3, 0.8])),
        (Cylinder(0.2, 0.8), RigidTransform(RollPitchYaw(0.5, 0, 0), [3.0, -0.9, 1.2])),
        (Capsule(0.1, 0.5), RigidTransform([2.5, 0.1, 1.4])),
        (Box(0.02, 0.05, 0.05), RigidTransform([0.2, 0.0, 0.96])),  # too near
    ]
    scene_graph, ids = scene_of(shapes, roles=("perception",))
    add_renderer(scene_graph)
    builder = DiagramBuilder()
    builder.AddSystem(scene_graph)
    pinhole = depth_pinhole(IDEAL)
    limits = (float(IDEAL.limits[0]), float(IDEAL.limits[1]))
    camera = builder.AddSystem(
        make_depth_camera(scene_graph.world_frame_id(), X_WC, pinhole, limits)
    )
    sensor = builder.AddSystem(DepthSensor(IDEAL, rate=10.0))
    builder.Connect(scene_graph.get_query_output_port(), camera.GetInputPort("geometry_query"))
    builder.Connect(camera.GetOutputPort("depth_image_32f"), sensor.GetInputPort("rendered"))
    simulator = Simulator(builder.Build())
    simulator.Initialize()
    root = simulator.get_context()
    own = sensor.GetMyContextFromRoot(root)
    query = scene_graph.get_query_output_port().Eval(scene_graph.GetMyContextFromRoot(root))
    u, v = np.meshgrid(np.arange(pinhole.width), np.arange(pinhole.height))
    x, y = (u.ravel() - pinhole.cx) / pinhole.fx, (v.ravel() - pinhole.cy) / pinhole.fy
    rays = np.column_stack([x, y, np.ones(u.size)])
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    distances, hits = SceneShapes().cast(
        query, X_WC.translation(), rays @ X_WC.rotation().matrix().T
    )
    depth = (distances * rays[:, 2]).reshape(IDEAL.height, IDEAL.width)
    depth = np.where(depth > limits[1], np.inf, np.where(depth < limits[0], 0.0, depth))
    flat = np.array(
        [hit is not None and isinstance(shapes[ids.index(hit)][0], Box) for hit in hits]
    )
    row = sensor.GetOutputPort("depth_row").Eval(own)
    image = sensor.GetOutputPort("depth_image").Eval(own).data[:, :, 0]
    np.testing.assert_array_equal(row, sensor.image(own)[IDEAL.height // 2])
    np.testing.assert_array_equal(image, sensor.image(own).astype(np.float32))
    return sensor.image(own), depth, flat.reshape(depth.shape)


def test_the_rendered_depth_is_that_of_the_scene():
    rendered, cast, flat = pictures()
    assert np.any(cast == 0.0)
    # At the outline of a thing, a pixel is either on it or beside it.
    padded = np.pad(cast, 1, mode="edge")
    h, w = cast.shape
    around = np.stack([padded[i : i + h, j : j + w] for i in range(3) for j in range(3)])
    inside = np.ptp(around, axis=0) < 0.1
    assert np.mean(inside) > 0.8
    off = np.abs(rendered - cast)
    assert np.sum(inside & flat) > 2000
    assert np.max(off[inside & flat]) < FLAT
    assert np.sum(inside & ~flat) > 300
    assert np.max(off[inside & ~flat]) < ROUND


def sensor_images(model, depth, count, seed=0):
    """Images of a sensor that looks at one rendered picture, shape (count, h, w)."""
    sensor = DepthSensor(model, seed=seed)
    return np.array([sensor.reading(sensor.measure(depth.ravel(), k)) for k in range(1, count + 1)])


def test_noise_grows_with_the_square_of_depth():
    model = replace(IDEAL, width=100, height=4, noise=0.001, noise_per_square=0.002)
    depth = np.repeat([[1.0], [2.0], [4.0], [np.inf]], 100, axis=1)
    images = sensor_images(model, depth, 50, seed=2)
    np.testing.assert_array_equal(images, sensor_images(model, depth, 50, seed=2))
    assert not np.array_equal(images[:1], sensor_images(model, depth, 1, seed=3))
    for row, z in enumerate((1.0, 2.0, 4.0)):
        off = images[:, row] - z
        assert np.std(off) == pytest.approx(0.001 + 0.002 * z**2, rel=0.05)
    assert np.all(images[:, 3] == np.inf)


def test_what_is_out_of_range_is_said_as_drake_says_it():
    model = replace(IDEAL, width=4, height=1, noise=0.0)
    (image,) = sensor_images(model, np.array([[0.0, 0.2, 1.0, 7.0]]), 1)
    np.testing.assert_array_equal(image, [[0.0, 0.0, 1.0, np.inf]])


def test_an_image_on_the_port_is_drakes():
    sensor = DepthSensor(IDEAL)
    own = sensor.CreateDefaultContext()
    sensor.GetInputPort("rendered").FixValue(own, ImageDepth32F(IDEAL.width, IDEAL.height))
    assert sensor.GetOutputPort("depth_image").Eval(own).data.shape == (60, 80, 1)
