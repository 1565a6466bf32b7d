"""Geometry of a cable robot: poses, cables over pulleys, motion types, and rays.

**Poses.** Angles (phi, theta, psi) mean R = Rx(phi) Ry(theta) Rz(psi), which is not Drake's
RollPitchYaw. Twists and adjoints are ordered (rotation, translation). A pose as numbers is a row of
seven: quaternion (w, x, y, z) with w >= 0, then position [m], made and read by `poses` alone.

**Cables.** A = exit point, B = anchor point. `CableSet` holds all constants of a robot's cables, as
they are or as somebody believes them to be; it goes whole to whoever needs it, so that pulleys are
known or left out by a choice. The Jacobian J maps the platform's spatial velocity V_WP = (w, v) to
length rates, l_dot = J V_WP; by virtual work the tensions t load the platform with W t, W = -J'.
`MotionType` says which twists a platform has, and reduces such matrices to them.

**Rays** and the first surface on each: boxes, spheres, cylinders, capsules, ellipsoids, half
spaces, meshes. Drake's SceneGraph answers distances and contact, but no rays; `systems.sensors`
packs its shapes for `RayScene`. Frames: W the world, G of a shape, S of a sensor (x ahead, y to the
left). Distances are along the ray [m], infinite where it meets nothing.

Source: servoing thesis 1.1.2, 1.4, (1.9) with the sign of the tangent point put right, (1.19) and
(2.1); Gazebo thesis (2.1); Pott, Cable-Driven Parallel Robots, 2018, for pulleys; Ericson,
Real-Time Collision Detection, 2005, for rays.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
