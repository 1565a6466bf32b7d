"""Puts cables between any bodies of somebody's plant into a builder, with winches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.multibody.plant import ExternallyAppliedSpatialForceMultiplexer, MultibodyPlant
from pydrake.systems.framework import Context, DiagramBuilder, OutputPort

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableModelError, accepted_names
from cdpr_drake.geometry.cable_routes import CableRoutes
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_rest import Rest, hang
from cdpr_drake.models.plant_tree import unknown_joint
from cdpr_drake.systems.robots.assembly import NamedPorts, apply_force
from cdpr_drake.systems.robots.cable_forces import PORTS
from cdpr_drake.systems.robots.plant_step import TAUT, check_plant_step
from cdpr_drake.systems.robots.route_forces import RouteForces, RouteSpatialForces
from cdpr_drake.systems.robots.settings import CableSettings
from cdpr_drake.systems.robots.winches import VelocityWinch

AUTOMATIC, JOINTS, BODIES = "automatic", "joints", "bodies"
METHODS = (AUTOMATIC, JOINTS, BODIES)
"""How forces reach the plant: as a generalized force from compiled joints, as spatial forces on
bodies, or by the first where it knows all joints and else by the second."""


@dataclass(frozen=True, eq=False, kw_only=True)
class CablePorts(NamedPorts):
    """Cables and winches in a builder.

    Attributes:
        plant: The plant.
        forces: `RouteForces` or `RouteSpatialForces`.
        winches: The winches.
        method: How forces reach the plant, `JOINTS` or `BODIES`.
        why: Why not by `JOINTS`; empty where it is, or where `BODIES` was asked for.
    """

    plant: MultibodyPlant
    forces: Any
    winches: Any
    method: str
    why: str

    def cables(self) -> PlantCables:
        """The cables as they are simulated, for statics."""
        cables: PlantCables = self.forces.cables_of_plant
        return cables

    def hang(self, context: Context, **wishes: Any) -> Rest:
        """Puts the plant at rest on its cables: positions, no velocities, and lengths.

        Args:
            context: Root context of the built diagram; changed. Its positions are asked for.
            wishes: As for `models.hang`.

        Returns:
            The rest; whatever `held` says, the motors of joints must do.

        Raises:
            CdprError: As `models.hang`.
        """
        plant_context = self.plant.GetMyMutableContextFromRoot(context)
        rest = hang(self.cables(), plant_context, **wishes)
        self.put(context, rest)
        return rest

    def put(self, context: Context, rest: Rest) -> None:
        """Puts plant and winches at a rest, in the root context of the built diagram.

        Raises:
            CableModelError: The plant is discrete, and its time step longer than its cables bear
                there; names the largest one.
        """
        plant_context = self.plant.GetMyMutableContextFromRoot(context)
        winch_context = self.winches.GetMyMutableContextFromRoot(context)
        self.plant.SetPositions(plant_context, rest.positions)
        self.plant.SetVelocities(plant_context, np.zeros(self.plant.num_velocities()))
        self.winches.hold(winch_context, rest.unstrained_lengths, rest.tensions)
        cables, lengths = self.cables(), rest.unstrained_lengths
        check_plant_step(
            self.plant,
            plant_context,
            lambda own: cables.generalized_force(own, lengths),
            ", ".join(cables.routes.names),
        )


def add_cables(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    routes: CableRoutes,
    settings: CableSettings | None = None,
    *,
    winches: Any = None,
    rated_speed: float = np.inf,
    method: str = AUTOMATIC,
    name: str = "",
    rest: Rest | None = None,
) -> CablePorts:
    """Adds cables between bodies of a finalized plant of the builder, and winches.

    Forces add up with those of other cables, robots, and of what else is connected to the plant.

    Args:
        builder: The builder.
        plant: The plant, continuous or discrete; its state port and its inputs are connected.
        routes: The cables, made for that plant.
        settings: Model, pulleys, stiffness and damping; the defaults where None, which are without
            pulleys.
        winches: A block with the ports of `VelocityWinch` or `MotorWinch`; None: ideal winches.
        rated_speed: Largest cable speed of ideal winches [m/s].
        method: One of `METHODS`.
        name: Put before the names of the blocks.
        rest: Rest of the plant in default contexts, from `models.hang` on these cables: it becomes
            the plant's default positions and the default lengths of ideal winches. None: default
            positions stay, with cables that are just not taut.

    Returns:
        Handles and ports; `why` says it where `automatic` did not take compiled joints.

    Raises:
        CableModelError: The model cannot describe the cables, the method is not known, or `joints`
            is asked for and a joint is not known to it; or the plant is discrete and its time step
            longer than the cables bear, these and those added before: names the largest one.
        CableGeometryError: At the plant's default positions a cable cannot run.
    """
    if method not in METHODS:
        raise CableModelError(f"method: found {method!r}; {accepted_names(method, METHODS)}")
    settings, prefix = settings or CableSettings(), f"{name}_" if name else ""
    routes = routes.with_cables(settings.applied(routes.ends))
    cables = PlantCables(plant, routes, settings.model_of())
    why = unknown_joint(plant, routes.touched_bodies())
    if why and method == JOINTS:
        raise CableModelError(why)
    chosen = BODIES if why or method == BODIES else JOINTS
    kind = RouteForces if chosen == JOINTS else RouteSpatialForces
    model = settings.model_of()
    forces = builder.AddNamedSystem(prefix + "cables", kind(plant, routes, model))
    forces.cables_of_plant = PlantCables(plant, forces.routes(), model)
    _check_step(builder, forces.cables_of_plant)
    if winches is None:
        if rest is None:
            home, _ = cables.lengths_and_jacobian(plant.CreateDefaultContext())
        else:
            home = rest.unstrained_lengths
            plant.SetDefaultPositions(rest.positions)
        winches = VelocityWinch(home, rated_speed)
    winch = builder.AddNamedSystem(prefix + "winches", winches)
    connect_cables(builder, plant, forces, name=name)
    inputs = {}
    for port in map(winch.get_input_port, range(winch.num_input_ports())):
        if port.get_name() == "tensions":
            builder.Connect(forces.GetOutputPort("drum_tensions"), port)
        else:
            inputs[port.get_name()] = port
    for port_name in ("unstrained_lengths", "unstrained_length_rates"):
        builder.Connect(winch.GetOutputPort(port_name), forces.GetInputPort(port_name))
    outputs = {port: forces.GetOutputPort(port) for port in PORTS}
    for port in map(winch.get_output_port, range(winch.num_output_ports())):
        outputs[port.get_name()] = port
    outputs["plant_state"] = plant.get_state_output_port()
    outputs["body_poses"] = plant.get_body_poses_output_port()
    outputs["body_velocities"] = plant.get_body_spatial_velocities_output_port()
    outputs["body_accelerations"] = plant.get_body_spatial_accelerations_output_port()
    why = why if method == AUTOMATIC else ""
    return CablePorts(
        inputs, outputs, plant=plant, forces=forces, winches=winch, method=chosen, why=why
    )


def _check_step(builder: DiagramBuilder, cables: PlantCables) -> None:
    """Checks the step of a discrete plant, with its cables that are in the builder already."""
    plant = cables.plant
    if plant.time_step() == 0.0:
        return
    defaults, every = plant.CreateDefaultContext(), list[PlantCables]()
    for system in builder.GetSystems():
        if getattr(system, "cables_of_plant", None) is not None:
            before: PlantCables = system.cables_of_plant
            every += [before] if before.plant is plant else []
    taut = [(1.0 - TAUT) * each.lengths_and_jacobian(defaults)[0] for each in every]

    def pull(context: Context) -> Array:
        forces = zip(every, taut, strict=True)
        return np.sum([each.generalized_force(context, l0) for each, l0 in forces], axis=0)

    check_plant_step(plant, defaults, pull, ", ".join(cables.routes.names))


def connect_cables(
    builder: DiagramBuilder, plant: MultibodyPlant, forces: Any, *, name: str = ""
) -> None:
    """Connects `RouteForces` or `RouteSpatialForces` with their plant, beside other forces.

    Args:
        builder: The builder that has both.
        plant: The plant.
        forces: The cables.
        name: Put before the name of a block that adds forces.
    """
    if isinstance(forces, RouteForces):
        builder.Connect(plant.get_state_output_port(), forces.GetInputPort("plant_state"))
        apply_force(builder, plant, forces.GetOutputPort("generalized_force"), name=name)
        return
    builder.Connect(plant.get_body_poses_output_port(), forces.GetInputPort("body_poses"))
    builder.Connect(
        plant.get_body_spatial_velocities_output_port(),
        forces.GetInputPort("body_spatial_velocities"),
    )
    apply_spatial_forces(builder, plant, forces.GetOutputPort("spatial_forces"), name=name)


def apply_spatial_forces(
    builder: DiagramBuilder, plant: MultibodyPlant, forces: OutputPort, *, name: str = ""
) -> None:
    """Applies a list of spatial forces, beside one that is applied already, if there is.

    Args:
        builder: The builder that has the plant.
        plant: The plant.
        forces: Port of a list of ExternallyAppliedSpatialForce.
        name: Put before the name of the block that joins it with what there was.
    """
    port = plant.get_applied_spatial_force_input_port()
    for (system, index), (source, number) in builder.connection_map().items():
        if system is plant and index == port.get_index():
            before = source.get_output_port(number)
            builder.Disconnect(before, port)
            both = builder.AddNamedSystem(
                (f"{name}_" if name else "") + "all_spatial_forces",
                ExternallyAppliedSpatialForceMultiplexer(2),
            )
            builder.Connect(before, both.get_input_port(0))
            builder.Connect(forces, both.get_input_port(1))
            forces = both.get_output_port()
    builder.Connect(forces, port)
