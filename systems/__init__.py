"""Drake blocks of cable robots, their settings, and what wires them into diagrams.

Rooms: `robots`, `cameras`, `servos`, `estimators`, `tension_control`, `sensors`, `monitoring`,
`worlds` hold blocks, each with its settings beside it; `scenarios` composes settings into files,
`diagrams` adds blocks to a builder. What one needs for a diagram of one's own is exported here.
Ports are words; each block's class has a table of them. Vectors of m are in the order of the
robot's cables.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
