"""A robot that looks for a box, takes it, and sets it down where a tag says.

`PickAndPlaceTask` is the phases as a function; `PickAndPlaceStateMachine` puts them into a diagram,
between cameras that look when they are asked to, dead reckoning, a visual servo and a `Gripper`.
The box is a free body of the plant, which contact holds on the table and the gripper's compliance
on the platform. Frames: W the world, P the platform, B the box, G the goal (B once it is set down),
O and T the tags of box and goal, C a camera.

Source: servoing thesis 5.4, which names occlusion in pick and place and several cameras against it.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
