"""Input that makes no sense is refused in one line that says what is accepted."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RevoluteJoint, RevoluteSpring, ScrewJoint, SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.errors import CableGeometryError, CableModelError, CdprError, TensionProblemError
from cdpr_drake.formats.plant_mjcf import export_plant_mjcf
from cdpr_drake.geometry.cable_routes import CableRoute, CableRoutes
from cdpr_drake.models.plant_bodies import whole_tree
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_rest import hang, settle
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.controllers.plant_tracking import PlantTensionDistributor, PlantTracking
from cdpr_drake.systems.robots.cable_forces import CableForces
from cdpr_drake.systems.robots.compiled_mechanism import CompiledMechanism
from cdpr_drake.systems.robots.route_assembly import add_cables
from cdpr_drake.systems.robots.route_forces import RouteForces
from cdpr_drake.systems.robots.settings import CableSettings
from tests.mechanisms.machines import Y, add_body, add_hinge
from tests.mechanisms.mechanism_cases import (
    alone,
    cables_of,
    machine,
    rest_of,
    robot_with_arm,
    screw_plant,
    taut_lengths,
)


def inertia(mass=1.0):
    return SpatialInertia.SolidBoxWithMass(mass, 0.2, 0.2, 0.1)


def one_body(make_joint=None, spatial=None, constrain=False):
    """A plant with a body, and a cable to it."""
    plant = MultibodyPlant(0.0 if not constrain else 1e-3)
    body = plant.AddRigidBody("body", spatial or inertia())
    other = plant.AddRigidBody("other", inertia())
    if make_joint:
        plant.AddJoint(make_joint(plant, body))
    if constrain:
        plant.AddWeldConstraint(body, RigidTransform(), other, RigidTransform())
    plant.Finalize()
    points = [(plant.world_body(), (1.0, 0.0, 0.5)), (body, np.zeros(3))]
    return plant, CableRoutes.of(plant, [CableRoute(points=points, stiffness=1e3)])


def screw(plant, body):
    return ScrewJoint("thread", plant.world_frame(), body.body_frame(), [0, 0, 1], 0.05, 0)


def reversed_hinge(plant, body):
    return RevoluteJoint("hinge", body.body_frame(), plant.world_frame(), [0, 0, 1])


def upper(name="planar_arm"):
    return alone(name).plant.GetBodyByName("upper")


def route(*points):
    cables = [CableRoute(points=points, stiffness=1e3)] if points else []
    return CableRoutes.of(alone("planar_arm").plant, cables)


END = (upper(), (0, 0, 1))


def add(settings=None, ends=None, **values):
    builder = DiagramBuilder()
    it = machine("mobile_masts", builder)
    return add_cables(builder, it.plant, it.with_ends(**(ends or {})), settings, **values)


def add_to_screw():
    builder = DiagramBuilder()
    return add_cables(builder, *screw_plant(builder), method="joints")


def mjcf(l0=1.0, **values):
    return export_plant_mjcf(*one_body(**values), np.array([l0]))


def sideways():
    plant, routes = one_body()
    plant.mutable_gravity_field().set_gravity_vector([1.0, 0.0, -9.0])
    heavy = replace(routes.ends, linear_weight=np.array([0.1]))
    return PlantCables(plant, routes.with_cables(heavy), "catenary")


def robot_with_a_load():
    """Its state would be taken for the platform's."""
    plant = MultibodyPlant(0.0)
    in_plant = add_robot(plant, load_robot("planar"))
    plant.AddRigidBody("load", in_plant.model_instance, inertia())
    plant.Finalize()
    return CableForces(in_plant)


def equilibrium_with_an_arm():
    _, in_plant, blocks, diagram = robot_with_arm()
    context = diagram.CreateDefaultContext()
    return blocks.set_at_equilibrium(context, in_plant.robot.home.transform())


def sprung():
    plant = MultibodyPlant(0.0)
    link = add_body(plant, "link", 1.0, (0.4, 0.05, 0.06), (0.2, 0.0, 0.0))
    joint = add_hinge(plant, "hinge", plant.world_body(), (0, 0, 0), link, Y, 0.3)
    plant.AddForceElement(RevoluteSpring(joint, 0.0, 1.0))
    plant.Finalize()
    return plant


def long_step():
    it = alone("two_platforms")
    stiff = it.with_ends(stiffness=1e7)
    block = CompiledMechanism(it.plant, stiff, period=0.1, max_step=0.02)
    context = block.CreateDefaultContext()
    block.GetInputPort("cable_velocities").FixValue(context, np.full(stiff.count, -0.1))
    Simulator(block, context).AdvanceTo(2.0)


def arm(verb, *arguments, cables=None, **values):
    return verb(cables or cables_of("planar_arm"), alone("planar_arm").home(), *arguments, **values)


def rigid():
    """Cables that do not stretch."""
    cables = replace(cables_of("planar_arm"), model="inextensible")
    return arm(settle, rest_of("planar_arm").unstrained_lengths, cables=cables)


def tracking(*values):
    return PlantTracking(alone("two_platforms").plant, *values)


def share(*values, name="two_platforms", **options):
    return PlantTensionDistributor(cables_of(name), (1.0, 300.0), *values, **options)


REFUSALS = {
    "no cables": (route, "routes: found none"),
    "one point": (lambda: route(END), "found 1; accepted: at least an exit"),
    "two numbers": (lambda: route((upper(), (0, 0)), END), "accepted: three finite numbers"),
    "another plant": (
        lambda: route((upper("hanging_arm"), (0, 0, 0)), END), "of another plant; accepted"
    ),
    "a name for a frame": (
        lambda: route(("upper", (0, 0, 0)), END),
        "found str for a frame; accepted: a Frame or a body",
    ),
    "method": (lambda: add(method="rows"), "method: found 'rows'; accepted: automatic"),
    "joints of a screw": (
        add_to_screw, "joint thread: found a ScrewJoint; accepted by the compiled joints"
    ),
    "reversed joint": (
        lambda: RouteForces(*one_body(reversed_hinge)), "body: found no joint that carries it"
    ),
    "eyelets of heavy cables": (
        lambda: add(CableSettings(model="catenary"), {"linear_weight": 0.1}),
        "eyelets on a cable with weight; accepted for the catenary: none",
    ),
    "sagging over anchor pulleys": (
        lambda: cables_of(
            "mobile_bases", "catenary", linear_weight=0.1, anchor_pulley_radius=0.02
        ),
        "accepted for the catenary: 0 [m]",
    ),
    "sagging over pulleys that tilt": (
        lambda: cables_of("mobile_bases", "catenary", linear_weight=0.1, pulley_radius=0.02),
        "at an exit point on a moving body; accepted for the catenary: 0 [m]",
    ),
    "sagging where gravity is aslant": (sideways, "accepted: gravity along -z, or straight"),
    "model": (lambda: add(CableSettings(model="rubber")), "found 'rubber'; accepted: inextensible"),
    "lengths to settle": (
        lambda: arm(settle, [1.0, -1.0, 1.0, 1.0]), "accepted: 4 numbers > 0 [m]"
    ),
    "rigid cables": (rigid, "accepted: one of elastic", CableModelError),
    "a joint that is not there": (
        lambda: arm(hang, held=["wrist"]),
        "joint: found wrist; accepted: one of DefaultModelInstance::elbow",
    ),
    "no tensions": (
        lambda: arm(hang, lower=1.0, upper=2.0), "found no tensions within 1..2 N that hold joint"
    ),
    "an arm at equilibrium": (
        equilibrium_with_an_arm, "found arm::arm on the platform of acrobot_fully", CableModelError
    ),
    "screw in MJCF": (
        lambda: mjcf(make_joint=screw), "found a ScrewJoint; accepted by MJCF: BallRpyJoint"
    ),
    "loops in MJCF": (lambda: mjcf(constrain=True), "constraints: found 1 in the plant"),
    "massless in MJCF": (lambda: mjcf(spatial=SpatialInertia.Zero()), "body body: found mass 0 kg"),
    "rod in MJCF": (
        lambda: mjcf(spatial=SpatialInertia.ThinRodWithMass(1.0, 0.3, [0, 0, 1])),
        "body body: found mass 1 kg and moments 0,",
    ),
    "a body in a robot's model instance": (
        robot_with_a_load, "model instance planar: found 19 states; accepted: 6"
    ),
    "lengths in MJCF": (lambda: mjcf(l0=0.0), "accepted: 1 numbers > 0 [m]"),
    "springs": (
        lambda: whole_tree(sprung()), "force elements: found 1 beside gravity, such as springs",
        CableModelError,
    ),
    "discrete": (
        lambda: whole_tree(machine("planar_arm", time_step=1e-3).plant),
        "time_step: found 0.001 s", CableModelError,
    ),
    "long step": (long_step, "steps shorter than 0.02 s", CableGeometryError),
    "passive arm": (
        lambda: share(name="hanging_arm"), "8 cables for 9 degrees of freedom", TensionProblemError
    ),
    "kp": (lambda: tracking(-1.0, 1.0), "kp: found -1.0; accepted: one fin", TensionProblemError),
    "kd": (lambda: tracking(1.0, np.ones(3)), "kd: found", TensionProblemError),
    "believed": (
        lambda: tracking(1.0, 1.0, alone("planar_arm").plant), "believed: found 2 positions",
        TensionProblemError,
    ),
    "rate": (lambda: share(rate=0.0), "rate: found 0", TensionProblemError),
    "no method": (lambda: share("closed"), "closed", TensionProblemError),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSALS)
def test_refusal(case):
    call, words, *error = REFUSALS[case]
    with pytest.raises(CdprError) as caught:
        call()
    message = str(caught.value)
    assert isinstance(caught.value, tuple(error) or CdprError)
    assert words in message
    assert "accepted" in message
    assert "\n" not in message


def test_a_file_that_cannot_be_written(tmp_path):
    it, path = alone("planar_arm"), tmp_path / "no" / "a.xml"
    with pytest.raises(CdprError, match="cannot be written"):
        export_plant_mjcf(it.plant, it.routes, taut_lengths("planar_arm"), path)
    assert not path.parent.exists()
