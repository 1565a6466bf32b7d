"""Scenario files: one run each, composed of the settings of the blocks it uses.

The YAML files beside these modules come with the package. `cdpr_drake.systems.diagrams` loads,
checks and wires them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
