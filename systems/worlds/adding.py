"""Puts a world round a robot: into its scene, into its plant, and what measures it beside it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from pydrake.geometry import SceneGraph
from pydrake.multibody.tree import RigidBody
from pydrake.systems.framework import Context, DiagramBuilder, OutputPort

from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.models.robot_in_plant import RobotInPlant
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.robots.assembly import apply_force
from cdpr_drake.systems.worlds.body_driver import BodyDriver
from cdpr_drake.systems.worlds.clearances import WorldClearances
from cdpr_drake.systems.worlds.contact import MODEL_INSTANCE, ContactLaw, add_contact, contact_law
from cdpr_drake.systems.worlds.meters import ClearanceMeter, ContactMeter, ContactStop
from cdpr_drake.systems.worlds.settings import WorldSettings
from cdpr_drake.systems.worlds.world import World, WorldBody, make_world
from cdpr_drake.systems.worlds.world_scene import add_world_scene


class WorldInScene:
    """Adds a world to a robot's scene and, where they touch, to its plant.

    Attributes:
        world: The world.
        law: The law of contact; None: the platform passes through everything.
        driver: What moves the bodies that move, where there is contact; else None. Known once the
            plant is finalized.
    """

    def __init__(self, settings: WorldSettings, robot: Robot, *, contact: bool = True) -> None:
        """For a section `world` and a robot.

        Args:
            settings: The section.
            robot: The robot.
            contact: Whether contact counts that the settings ask for; pictures have none.

        Raises:
            WorldError: A body makes no sense; names the key.
        """
        self.world: World = make_world(settings, robot)
        self.law: ContactLaw | None = None
        if contact and settings.contact is not None:
            self.law = contact_law(settings.contact, robot)
        self.driver: BodyDriver | None = None

    def add(
        self,
        builder: DiagramBuilder,
        robot: RobotInPlant,
        scene_graph: SceneGraph,
        *,
        shown: bool = True,
    ) -> Callable[[], None]:
        """Adds it before the plant is finalized; for use as `add_to_scene` of `CableRobot`.

        Args:
            builder: The builder that has plant and scene graph.
            robot: The robot in its plant.
            scene_graph: The scene graph.
            shown: Whether the world is drawn, too.

        Returns:
            What is to be called once the plant is finalized; with contact it exports the plant's
            port contact_results.
        """
        if shown:
            add_world_scene(builder, scene_graph, self.world)
        if self.law is None:
            return lambda: None
        moving = add_contact(robot, scene_graph, self.world, self.law)
        return lambda: self._wire(builder, robot, moving)

    def _wire(
        self,
        builder: DiagramBuilder,
        robot: RobotInPlant,
        moving: list[tuple[WorldBody, RigidBody]],
    ) -> None:
        plant = robot.plant
        builder.ExportOutput(plant.get_contact_results_output_port(), CONTACT_RESULTS)
        if moving:
            self.driver = builder.AddNamedSystem("body_driver", BodyDriver(plant, moving))
            state = plant.get_state_output_port(plant.GetModelInstanceByName(MODEL_INSTANCE))
            builder.Connect(state, self.driver.GetInputPort("state"))
            apply_force(
                builder, plant, self.driver.GetOutputPort("generalized_force"), name="world"
            )

    def start(self, context: Context, robot: RobotInPlant) -> None:
        """Puts what moves where it is at the time of a root context, with its velocities."""
        if self.driver is not None:
            plant_context = robot.plant.GetMyMutableContextFromRoot(context)
            self.driver.start(plant_context, context.get_time())


CONTACT_RESULTS = "contact_results"
"""Output port of a robot's block that has contact."""


@dataclass(frozen=True, kw_only=True)
class WorldMeters:
    """What measures a robot in its world.

    Attributes:
        clearances: How distances are measured.
        clearance: Measures them as the run goes on.
        contact: Sums up contact; None where there is none.
        stop: Ends the run at the first touch; None unless asked for.
    """

    clearances: WorldClearances
    clearance: ClearanceMeter
    contact: ContactMeter | None
    stop: ContactStop | None

    def logged(self) -> dict[str, OutputPort]:
        """What of it is logged, by the names of its quantities."""
        ports = {name: self.clearance.GetOutputPort(name) for name in CLEARANCES}
        if self.contact is not None:
            ports |= {name: self.contact.GetOutputPort(name) for name in CONTACTS}
        return ports


CLEARANCES = ("clearance", "cable_clearance")
CONTACTS = ("contact_force", "contact_count")
"""Quantities of logs of runs in a world."""


def add_world_meters(
    builder: DiagramBuilder,
    world: World,
    robot: RobotInPlant,
    cables: CableSet,
    *,
    X_WP: OutputPort,
    contact_results: OutputPort | None = None,
    stop: bool = False,
) -> WorldMeters:
    """Adds blocks that measure a robot in its world.

    Args:
        builder: The builder that has the robot.
        world: The world.
        robot: The robot.
        cables: Its cables as they are simulated.
        X_WP: Pose of its platform.
        contact_results: Of its plant; None where the platform touches nothing.
        stop: Whether the first touch ends the simulation.
    """
    clearances = WorldClearances(robot.robot, world, cables)
    meter = builder.AddNamedSystem("clearance_meter", ClearanceMeter(clearances))
    builder.Connect(X_WP, meter.GetInputPort("X_WP"))
    contact = None
    if contact_results is not None:
        contact = builder.AddNamedSystem("contact_meter", ContactMeter(robot))
        builder.Connect(contact_results, contact.GetInputPort(CONTACT_RESULTS))
    ends = None
    if stop:
        ends = builder.AddNamedSystem("contact_stop", ContactStop(len(world.bodies)))
        builder.Connect(meter.GetOutputPort("clearance"), ends.GetInputPort("clearance"))
    return WorldMeters(clearances=clearances, clearance=meter, contact=contact, stop=ends)
