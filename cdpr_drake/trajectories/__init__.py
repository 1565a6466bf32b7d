"""Motions over time, and geometric paths that have none.

Quintic time laws and poses of rest (`PoseTrajectory`), steady motions and waypoints of objects, a
mobile robot on its track, samples; geometric paths (`PosePath`), which have a law of time as
`TimedPath`. Poses are X_WP of the platform or X_WO of an object; velocities and accelerations are
spatial vectors (rotation, translation) in W.

Source: Gazebo thesis (6.19) to (6.21), with signs as Drake's PiecewisePolynomial has them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
