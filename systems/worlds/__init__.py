"""The world round a robot: ground and obstacles, shown, touched and measured.

A world is a list of bodies with names (`World`), each made of shapes and with a motion that is
prescribed: nothing that it meets moves it. `WorldInScene` puts them into a robot's scene for
cameras and browsers, and, with contact, into its plant; `add_world_meters` adds what measures
clearances and forces. Frames: W the world, B of a body, G of a shape, P the platform. Cables are
compared with obstacles and pass through them.

Source: Gazebo thesis 4.4; each module names its own.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
