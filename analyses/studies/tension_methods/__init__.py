"""The Gazebo thesis' comparison of tension methods, repeated.

Source: Gazebo thesis 6.2 and 6.3.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
