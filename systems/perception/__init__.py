"""Sensors that look at the world round a robot, as Drake blocks.

Source: each block names its own.
"""

from cdpr_drake.systems.perception.scene_shapes import ROLES, SceneShapes

__all__ = ["ROLES", "SceneShapes"]
