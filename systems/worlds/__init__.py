"""The world round a robot: ground and obstacles, shown, touched and measured.

A world is a list of bodies with names (`World`), each made of shapes and with a motion that is
prescribed: nothing that it meets moves it. `WorldInScene` puts them into a robot's scene for
cameras and browsers, and, with contact, into its plant; `add_world_meters` adds what measures
clearances and forces. Frames: W the world, B of a body, G of a shape, P the platform. Cables are
compared with obstacles and pass through them.

Source: Gazebo thesis 4.4; each module names its own.
"""

from cdpr_drake.systems.worlds.adding import (
    CLEARANCES,
    CONTACT_RESULTS,
    CONTACTS,
    WorldInScene,
    WorldMeters,
    add_world_meters,
)
from cdpr_drake.systems.worlds.body_driver import BodyDriver
from cdpr_drake.systems.worlds.checks import check_world, world_problems
from cdpr_drake.systems.worlds.clearances import WorldClearances
from cdpr_drake.systems.worlds.contact import ContactLaw, add_contact, contact_law, contact_step
from cdpr_drake.systems.worlds.meters import ClearanceMeter, ContactMeter, ContactStop
from cdpr_drake.systems.worlds.model_files import Part, mesh_parts, model_parts
from cdpr_drake.systems.worlds.motions import BodyMotion, JointedBody, PathBody, SteadyBody
from cdpr_drake.systems.worlds.settings import (
    ContactSettings,
    GroundSettings,
    ObstacleSettings,
    WorldSettings,
    found_file,
)
from cdpr_drake.systems.worlds.world import World, WorldBody, make_world
from cdpr_drake.systems.worlds.world_scene import WorldScene, add_world_scene

__all__ = [
    "CLEARANCES", "CONTACTS", "CONTACT_RESULTS", "BodyDriver", "BodyMotion", "ClearanceMeter",
    "ContactLaw", "ContactMeter", "ContactSettings", "ContactStop", "GroundSettings", "JointedBody",
    "ObstacleSettings", "Part", "PathBody", "SteadyBody", "World", "WorldBody", "WorldClearances",
    "WorldInScene", "WorldMeters", "WorldScene", "WorldSettings", "add_contact", "add_world_meters",
    "add_world_scene", "check_world", "contact_law", "contact_step", "found_file", "make_world",
    "mesh_parts", "model_parts", "world_problems",
]  # fmt: skip
