"""Cable robots as Drake blocks: cables, winches, platform pose, or all of them as one.

`add_cable_robot` puts cables and winches on a platform that is in somebody's plant; `CableRobot`
is a whole robot as one Diagram, made by it. Settings stand in `settings`; robots come from
`cdpr_drake.models`. Cable order is that of the robot's file, lengths are positive when paid out.

Source: servoing thesis 2.2 and 2.3; each block names its own.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
