"""Pose of the platform from images and lengths, by Kalman filters too; wrenches, sensors, failures.

Errors of a pose are twists in the body frame, X_true = X exp(e), ordered (rotation, translation).

`sensor_filter` fuses many sensors, with gates: `sensor_models` says what each reads of a belief,
`source_gates` takes readings in or leaves them out, `camera_miscalibration` weighs whether cameras
are where they are told to be. `pose_filter` fuses one camera with lengths, and finds errors of the
robot's points.

`wrench_observers` tell what pushes the platform beside its cables, from tensions and poses.

Source: servoing thesis 2.1 and 2.3; for the invariant filter, Barrau and Bonnabel, 2017.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
