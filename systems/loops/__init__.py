"""A visual servo as one loop, without a Drake Diagram: for many runs of it.

`ServoLoop` calls what the blocks of a diagram call, the kernels of the robot and the methods of
camera, servo, estimators, sensors, monitor and tension corrector that know no context, at the times
and in the order of Drake's Simulator. `diagram_reason` says which scenarios it cannot do,
`set_loop` chooses. `MotorTracking` tracks a trajectory by motors.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
