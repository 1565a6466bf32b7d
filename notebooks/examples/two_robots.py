"""Two robots: in one MultibodyPlant with a ball; one winds its cables in, the other waits."""

import numpy as np
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

import cdpr_drake as cdpr
from cdpr_drake.models import moved_robot

builder = DiagramBuilder()
plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
small = cdpr.load_robot("acrobot_small")
in_plant = {
    "left": cdpr.add_robot(plant, small, "left"),
    "right": cdpr.add_robot(plant, moved_robot(small, [2.0, 0.0, 0.0]), "right"),
}
ball = SpatialInertia.SolidSphereWithMass(0.5, 0.05)
plant.AddRigidBody("ball", plant.AddModelInstance("toys"), ball)
plant.Finalize()

robots = []
for name, speed in (("left", -0.01), ("right", 0.0)):
    block = cdpr.add_cable_robot(builder, in_plant[name], name=name)
    winding = builder.AddSystem(ConstantVectorSource(np.full(8, speed)))  # [m/s], all cables
    builder.Connect(winding.get_output_port(), block.GetInputPort("cable_velocities"))
    robots.append(block)
diagram = builder.Build()

simulator = Simulator(diagram)
for block in robots:
    block.set_at_equilibrium(simulator.get_mutable_context(), block.robot.home.transform())
ResetIntegratorFromFlags(simulator, "runge_kutta3", 1e-3)
simulator.AdvanceTo(0.5)
for name, each in in_plant.items():
    X_WP = each.pose(plant.GetMyContextFromRoot(simulator.get_context()))
    print(name, X_WP.translation().round(4))
