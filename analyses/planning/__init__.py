"""Planned motions of a robot: along a given path, on a free path, or from rest to rest.

* Along a path, and on a free path: paths from files, the robot's limits, the plan, and its tracking
  by the simulated robot. Limits are those of the robot file: tensions, rated speed and torque of
  the motors; a share of them is left to the feedback that tracks the plan.
* From rest to rest on elastic cables: collocation, input shaping, multiple shooting.

Source: Tedrake, Underactuated Robotics, direct collocation, as Drake has it.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
