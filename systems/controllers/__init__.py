"""Controllers as Drake blocks, with their settings: visual servos, and control of cable tensions.

* Visual servos: `FeatureServo`, and planned motions in its place. `SCHEMES` is the table of
  schemes: a new one is a class of features and a row of it.
* Dynamic control by cable tensions: computed torque, and `TensionDistributor`.
* Beside a visual servo: `TensionCorrector` takes up slack; `TorqueController` is visual servoing by
  torque.

Source: visual servos: servoing thesis 1.4 and 4.2; control of tensions: Gazebo thesis 6.1 and 6.2,
servoing thesis 5.2.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
