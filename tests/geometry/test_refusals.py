"""Cables, shapes, motions and poses that cannot be are refused in one line that names them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake import geometry as rays
from cdpr_drake.cables.models import check_model
from cdpr_drake.errors import (
    CableGeometryError,
    CableModelError,
    CdprError,
    RobotFileError,
    SensorError,
    WorkspaceError,
)
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.convex_shapes import ConvexShape, mesh_vertices
from cdpr_drake.geometry.motion_type import MotionType
from cdpr_drake.geometry.pose_accuracy import repeatability
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.proofs.robot_sets import ProvenSets
from tests.geometry.test_cables import BOARD
from tests.geometry.test_pulleys import ORIGIN, Z, made
from tests.models.robots import content_of, robot_of

X, Y, _ = np.eye(3)
NAN = np.nan
CABLES = CableSet.make(np.eye(3, 2), np.zeros((3, 2)), 1e5)


def robot(name, **pulley):
    content = content_of(name)
    content["pulley"].update(pulley)
    return robot_of(content)


def small(X_WP=None, **changes):
    """Paths of ACROBOT; without a pose where its anchor point 7 is its exit point."""
    cables = replace(load_robot("acrobot_small").cable_set().without_pulleys(), **changes)
    return cable_paths(X_WP or RigidTransform(cables.p_WA[:, 6] - cables.p_PB[:, 6]), cables)


def obj(text):
    return rays.obj_triangles(text, "plate.obj")


CHANGES = [
    ({"p_PB": np.zeros((3, 1))}, "p_PB: found shape"),
    ({"stiffness": np.array([1e5, 0.0])}, "stiffness of cable 2: found 0.0; accepted"),
    ({"stiffness": np.array([1e5, np.inf])}, "stiffness of cable 2"),
    ({"retardation": np.array([-1e-4, 0.0])}, "retardation of cable 1"),
    ({"pulley_radius": np.array([0.0, -0.1])}, "pulley_radius of cable 2"),
    ({"linear_weight": np.array([0.0, NAN])}, "linear_weight of cable 2"),
    ({"breaking_load": np.array([0.0, 1.0])}, "breaking_load of cable 1"),
    ({"swivel_axis": np.ones((3, 2))}, "swivel_axis of cable 1"),
    ({"p_WA": np.full((3, 2), NAN)}, "p_WA of cable 1"),
]


@pytest.mark.parametrize(("change", "words"), CHANGES)
def test_refusal_of_constants_of_cables(change, words):
    with pytest.raises(CableModelError, match=words):
        replace(CABLES, **change)


def cables(m=3, **values):
    return CableSet.make(np.eye(3, m), np.zeros((3, m)), 1e5, **values)


def shape(points, name="plate"):
    return ConvexShape.mesh(np.array(points), name=name)


def each_in_the_others_groove():
    return cable_paths(RigidTransform([0.2, 0.0, 0.05]), made(ORIGIN, ORIGIN, Z, Z, 0.3, 0.3))


IN_GROOVE = np.where(np.arange(8) == 3, 1.5, 0.0045)
BY_ERROR = {
    CableModelError: {
        "no cables": (lambda: cables(0), "with m >= 1 cables"),
        "arm and pulley": (
            lambda: cables(arm=0.1, pulley_radius=0.02),
            "arm of cable 1: found 0.1; accepted: 0 with pulle",
        ),
        "negative arm": (lambda: cables(arm=-0.1), "accepted: a finite number >= 0"),
        "sagging on arms": (
            lambda: check_model("catenary", BOARD), "arm of cable 1: found 0.1534; accepted for"
        ),
    },
    RobotFileError: {
        "axis": (
            lambda: robot("planar", swivel_axis=[0, 0, 0]), "pulley.swivel_axis: found [0, 0, 0]"
        ),
        "arm and pulley": (
            lambda: robot("maslow_4", radius=0.02), "pulley.arm: found 0.1534 with pulleys"
        ),
    },
    WorkspaceError: {
        "proof on arms": (
            lambda: ProvenSets.find("maslow_4", ["wrench-closure"]),
            "certify: found maslow_4 with arms, pulley.arm 0.15",
        )
    },
    CableGeometryError: {
        "within the arm": (
            lambda: cable_paths(RigidTransform([0.1, 1.95, 0.0]), BOARD),
            "within the length 0.1534 m of its arm",
        ),
        "in the groove": (
            lambda: small(RigidTransform([0.0, 0.0, 0.6]), pulley_radius=IN_GROOVE),
            "cable 4: its anchor point ", "of radius 1.5 m",
        ),
        "on the exit point": (small, "cable 7: ", "lies on its exit point"),
        "in grooves": (
            each_in_the_others_groove, "cable 1: no line touches its pulleys of radius"
        ),
        "flat": (lambda: shape([X, Y, -X, -Y]), "plate: found 4 vertices in one plane"),
        "triangle": (lambda: shape([X, Y, -X]), "plate: found 3 vertices in one plane"),
        "ball": (
            lambda: ConvexShape.sphere(X, -1.0, "ball"), "ball: found radius -1; accepted: >= 0 [m]"
        ),
        "no points": (
            lambda: ConvexShape(np.zeros((0, 3))), "shape: found points of shape (0, 3)"
        ),
        "NaN": (lambda: ConvexShape(np.array([[NAN, 0, 0]])), "not finite"),
        "box": (lambda: ConvexShape.box(X), "box: found shape (3,); accepted: (15,)"),
        "no mesh": (lambda: mesh_vertices(Path("b.obj")), "there is no such mesh"),
        "type": (lambda: MotionType("4T", (0, 0, 1)), "accepted"),
        "motion axis": (lambda: MotionType("1T", (0, 0, 0)), "accepted"),
        "short axis": (lambda: MotionType("2T", (1, 0)), "accepted"),
    },
    SensorError: {
        "few numbers": (lambda: obj("v 1 2\nf 1 2 3"), "plate.obj: "),
        "few corners": (lambda: obj("v 0 0 0\nf 1 2 3"), "plate.obj: "),
        "corner 0": (lambda: obj("f 0 1 2"), "plate.obj: "),
        "words": (lambda: obj("nothing"), "plate.obj: "),
    },
    CdprError: {"no poses": (lambda: repeatability([], RigidTransform()), "at least one pose")},
}  # fmt: skip
REFUSALS = [(error, name) for error, rows in BY_ERROR.items() for name in rows]


@pytest.mark.parametrize(("error", "name"), REFUSALS)
def test_refusal(error, name):
    call, *words = BY_ERROR[error][name]
    with pytest.raises(error) as caught:
        call()
    for part in words:
        assert part in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize(
    ("text", "words"),
    [("v 0 0 0\nv 1 0 zero\n", "line 2: found 'v 1 0 zero'"), ("f 1 2 3\n", "found no vertices")],
)
def test_a_mesh_file_that_cannot_be_read(tmp_path, text, words):
    path = tmp_path / "a.obj"
    path.write_text(text)
    with pytest.raises(CableGeometryError, match=words):
        mesh_vertices(path)
