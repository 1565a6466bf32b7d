"""Estimators of the platform's pose as Drake blocks.

`ESTIMATORS` is their table: a new one is a block and a row of it. Every estimator has the output
X_WP and inputs that bear the names of what it reads.

Source: servoing thesis 2.1 and 2.3, estimators 1 to 7; fusion: see `estimation.pose_filter`; of two
cameras: perspectives, and `estimation.sensor_filter`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
