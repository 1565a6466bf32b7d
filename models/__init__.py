"""Robots as data: their files, schema and loader, and what builds them into a MultibodyPlant.

* Files: a robot is a folder of `robots/` with a YAML file and a README of provenance; `load_robot`
  reads it. Poses in files are position [m] and angles (phi, theta, psi) in degrees, R = Rx Ry Rz.
* Schema: `Robot` is a robot file; `Robot.cable_set()` gives all constants of its cables. Sections
  of it are what a robot has in addition to its points: materials, pulleys, shapes, rails, winches.
  Refusals of several sections together are in `robot_refusals`.
* Cameras and sensors are catalogues of what manufacturers publish.
* Plant: `add_robot` puts a platform into anybody's plant.

Source: each robot's README.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
