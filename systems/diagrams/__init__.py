"""Wires blocks into Diagrams: by scenario, or piece by piece into somebody's own builder.

* Each `add_...` takes a builder, handles of what is there already, and one dataclass of settings,
  and returns handles; `build_visual_servo` and `build_tension_control` are compositions of them.
* Fusion of sensors: what the filter is told and may read, which needs settings of camera, robot and
  sensors together, and checks of them. The filter itself is
  `estimators.sensor_fusion.SensorFusion`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
