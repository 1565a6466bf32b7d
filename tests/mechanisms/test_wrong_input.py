"""Wrong input gives one line that says what was found and what is accepted."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RevoluteJoint, ScrewJoint, SpatialInertia
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.cable_routes import CableRoute, CableRoutes
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_mjcf import export_plant_mjcf
from cdpr_drake.models.plant_rest import hang, settle
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.cable_forces import CableForces
from cdpr_drake.systems.robots.route_assembly import add_cables
from cdpr_drake.systems.robots.route_forces import RouteForces
from cdpr_drake.systems.robots.settings import CableSettings
from tests.mechanisms.cabled import alone, cables_of, taut_lengths
from tests.mechanisms.machines import machine


def inertia(mass=1.0):
    return SpatialInertia.SolidBoxWithMass(mass, 0.2, 0.2, 0.1)


def one_body(make_joint=None, spatial=None, constrain=False):
    """A plant with one body, and a cable to it."""
    plant = MultibodyPlant(0.0 if not constrain else 1e-3)
    body = plant.AddRigidBody("body", spatial or inertia())
    other = plant.AddRigidBody("other", inertia())
    if make_joint:
        plant.AddJoint(make_joint(plant, body))
    if constrain:
        zero = RigidTransform()
        plant.AddWeldConstraint(body, zero, other, zero)
    plant.Finalize()
    route = CableRoute(points=[(plant.world_body(), (1.0, 0.0, 0.5)), (body, np.zeros(3))],
                       stiffness=1e3)  # fmt: skip
    return plant, CableRoutes.of(plant, [route])


def screw(plant, body):
    return ScrewJoint("thread", plant.world_frame(), body.body_frame(), [0, 0, 1], 0.05, 0)


def reversed_hinge(plant, body):
    return RevoluteJoint("hinge", body.body_frame(), plant.world_frame(), [0, 0, 1])


def route(points, **values):
    plant = alone("planar_arm").plant
    return lambda: CableRoutes.of(plant, [CableRoute(points=points, stiffness=1e3, **values)])


def add(settings=None, **values):
    builder = DiagramBuilder()
    made = machine("mobile_masts", builder)
    routes = made.with_ends(**values.pop("ends", {}))
    return add_cables(builder, made.plant, routes, settings, **values)


def add_to(make_joint):
    builder = DiagramBuilder()
    plant, routes = one_body(make_joint)
    builder.AddSystem(plant)
    return add_cables(builder, plant, routes, method="joints")


def mjcf(make_joint=None, spatial=None, constrain=False, l0=1.0):
    plant, routes = one_body(make_joint, spatial, constrain)
    return export_plant_mjcf(plant, routes, np.array([l0]))


def upper(name="planar_arm"):
    return alone(name).plant.GetBodyByName("upper")


def sideways():
    plant, routes = one_body()
    plant.mutable_gravity_field().set_gravity_vector([1.0, 0.0, -9.0])
    heavy = replace(routes.ends, linear_weight=np.array([0.1]))
    return PlantCables(plant, routes.with_cables(heavy), "catenary")


def robot_with_a_load():
    """Whose state would be taken for the platform's."""
    plant = MultibodyPlant(0.0)
    in_plant = add_robot(plant, load_robot("planar"))
    plant.AddRigidBody("load", in_plant.model_instance, inertia())
    plant.Finalize()
    return CableForces(in_plant)


WRONG = {
    "no cables": (
        lambda: CableRoutes.of(alone("planar_arm").plant, []),
        "routes: found none",
    ),
    "one point": (lambda: route([(upper(), (0, 0, 0))])(), "found 1; accepted: at least an exit"),
    "two numbers": (
        lambda: route([(upper(), (0, 0)), (upper(), (0, 0, 1))])(),
        "accepted: three finite numbers",
    ),
    "another plant": (
        lambda: route([(upper("hanging_arm"), (0, 0, 0)), (upper(), (0, 0, 1))])(),
        "of another plant; accepted",
    ),
    "a name for a frame": (
        lambda: route([("upper", (0, 0, 0)), (upper(), (0, 0, 1))])(),
        "found str for a frame; accepted: a Frame or a body",
    ),
    "method": (lambda: add(method="rows"), "method: found 'rows'; accepted: automatic"),
    "joints of a screw": (
        lambda: add_to(screw),
        "joint thread: found a ScrewJoint; accepted by the compiled joints",
    ),
    "reversed joint": (
        lambda: RouteForces(*one_body(reversed_hinge)),
        "body: found no joint that carries it",
    ),
    "eyelets of heavy cables": (
        lambda: add(CableSettings(model="catenary"), ends={"linear_weight": 0.1}),
        "eyelets on a cable with weight; accepted for the catenary: none",
    ),
    "sagging over anchor pulleys": (
        lambda: PlantCables(
            alone("mobile_bases").plant,
            alone("mobile_bases").with_ends(linear_weight=0.1, anchor_pulley_radius=0.02),
            "catenary",
        ),
        "accepted for the catenary: 0 [m]",
    ),
    "sagging over pulleys that tilt": (
        lambda: PlantCables(
            alone("mobile_bases").plant,
            alone("mobile_bases").with_ends(linear_weight=0.1, pulley_radius=0.02),
            "catenary",
        ),
        "at an exit point on a moving body; accepted for the catenary: 0 [m]",
    ),
    "sagging where gravity is aslant": (sideways, "accepted: gravity along -z, or straight"),
    "model": (lambda: add(CableSettings(model="rubber")), "found 'rubber'; accepted: inextensible"),
    "lengths to settle": (
        lambda: settle(cables_of("planar_arm"), alone("planar_arm").home(), [1.0, -1.0, 1.0, 1.0]),
        "accepted: 4 numbers > 0 [m]",
    ),
    "a joint that is not there": (
        lambda: hang(cables_of("planar_arm"), alone("planar_arm").home(), held=["wrist"]),
        "joint: found wrist; accepted: one of DefaultModelInstance::elbow",
    ),
    "no tensions": (
        lambda: hang(cables_of("planar_arm"), alone("planar_arm").home(), lower=1.0, upper=2.0),
        "found no tensions within 1..2 N that hold joint",
    ),
    "screw in MJCF": (lambda: mjcf(screw), "found a ScrewJoint; accepted by MJCF: BallRpyJoint"),
    "loops in MJCF": (lambda: mjcf(constrain=True), "constraints: found 1 in the plant"),
    "massless in MJCF": (
        lambda: mjcf(spatial=SpatialInertia.Zero()),
        "body body: found mass 0 kg",
    ),
    "rod in MJCF": (
        lambda: mjcf(spatial=SpatialInertia.ThinRodWithMass(1.0, 0.3, [0, 0, 1])),
        "body body: found mass 1 kg and moments 0,",
    ),
    "a body in a robot's model instance": (
        robot_with_a_load,
        "model instance planar: found 19 states; accepted: 6",
    ),
    "lengths in MJCF": (lambda: mjcf(l0=0.0), "accepted: 1 numbers > 0 [m]"),
}


@pytest.mark.parametrize("case", WRONG)
def test_one_line_says_what_is_accepted(case):
    ask, words = WRONG[case]
    with pytest.raises(CdprError) as problem:
        ask()
    said = str(problem.value)
    assert words in said
    assert "\n" not in said
    assert "accepted" in said


def test_a_file_that_cannot_be_written(tmp_path):
    made = alone("planar_arm")
    with pytest.raises(CdprError, match="cannot be written"):
        export_plant_mjcf(
            made.plant, made.routes, taut_lengths("planar_arm"), tmp_path / "no" / "a.xml"
        )
    assert not (tmp_path / "no").exists()
