"""Worlds and platforms without cables, for the tests of this folder."""

import numpy as np
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.systems.worlds.adding import WorldInScene
from cdpr_drake.systems.worlds.contact import contact_step
from cdpr_drake.systems.worlds.settings import (
    ContactSettings,
    GroundSettings,
    ObstacleSettings,
    WorldSettings,
)


def obstacle(name, kind, position, angles_deg=(0.0, 0.0, 0.0), **rest):
    pose = Pose(position=np.array(position, float), angles_deg=np.array(angles_deg, float))
    return ObstacleSettings(name=name, kind=kind, pose=pose, **rest)


def world_of(*obstacles, ground=0.0, contact=None):
    level = None if ground is None else GroundSettings(height=ground)
    return WorldSettings(ground=level, obstacles=list(obstacles), contact=contact)


class FreePlatform:
    """A platform that no cable holds, in a world, with Drake's simulator at the stable step."""

    def __init__(self, robot, settings, X_WP):
        builder = DiagramBuilder()
        self.plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
        self.in_plant = add_robot(self.plant, robot)
        world = WorldInScene(settings, robot)
        wire = world.add(builder, self.in_plant, scene_graph, shown=False)
        self.plant.Finalize()
        wire()
        self.world = world
        self.diagram = builder.Build()
        self.context = self.diagram.CreateDefaultContext()
        self.plant_context = self.plant.GetMyMutableContextFromRoot(self.context)
        self.in_plant.set_pose(self.plant_context, X_WP)
        world.start(self.context, self.in_plant)
        self.simulator = Simulator(self.diagram, self.context)
        friction = settings.friction()
        step = 0.8 * contact_step(robot, world.law, friction, "runge_kutta3")
        ResetIntegratorFromFlags(self.simulator, "runge_kutta3", step).set_fixed_step_mode(True)

    def pose(self):
        return self.in_plant.pose(self.plant_context)

    def contacts(self):
        return self.plant.get_contact_results_output_port().Eval(self.plant_context)


__all__ = ["ContactSettings", "FreePlatform", "obstacle", "world_of"]
