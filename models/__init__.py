"""Robots as data: their files, schema and loader, and what builds them into a MultibodyPlant.

A robot is a folder of `robots/` with a YAML file and a README of provenance; `load_robot` reads it,
`Robot.cable_set()` gives all constants of its cables. Cameras and sensors are catalogues of what
manufacturers publish. `add_robot` puts a platform into anybody's plant. Poses in files are position
[m] and angles (phi, theta, psi) in degrees, R = Rx Ry Rz.

Source: each robot's README.

What a robot is built of beside its points: materials, pulleys, shapes, rails, winches.

Schemas of sections of a robot file, and what follows from several of them together.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
