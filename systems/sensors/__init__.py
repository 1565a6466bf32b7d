"""Sensors as Drake blocks: of the robot itself, and of the world and motion.

* Of the robot: tensions, motor encoders, poses from outside. `SENSORS` is their table. Readings
  carry bias, noise, resolution and rate of a type of the catalogue, repeatable by a seed.
* Of motion: an inertial measurement unit, which an estimator that fuses sensors reads.
* Sections of `sensors`, such as laser scanners, look at the world and are logged:
  `cdpr_drake.sections`. `add_perception_sensors` adds them to a robot without a servo.

Each has its own rate and its own stream of random numbers, repeatable by a seed.

Cameras are in `systems.cameras`. Frames: S of a sensor (x ahead, y to the left), C of a camera (z
ahead, y down), H of a head, B of what carries it.

Source: each block names its own.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
