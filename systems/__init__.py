"""Drake blocks of cable robots, their settings, and what wires them into diagrams.

* Blocks, each with its settings beside it: `robots`, `cameras`, `sensors`, `estimators`,
  `controllers`, `monitoring`, `worlds`.
* `scenarios` composes settings into files, `diagrams` adds blocks to a builder.
* `pick_and_place` takes a box and sets it down; `loops` runs a visual servo without a diagram.

What one needs for a diagram of one's own is exported here. Ports are words; each block's class has
a table of them. Vectors of m are in the order of the robot's cables.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
