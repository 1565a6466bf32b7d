"""Robots that stand for all, for tests that would take long with each robot of the package.

The library grows; that each of its robots loads, hangs and steps is
`tests/models/test_library.py`'s.
"""

REPRESENTATIVE_ROBOTS = (
    "acrobot_fully_constrained",
    "acrobot_large",
    "acrobot_small",
    "caroca",
    "caroca_gazebo",
    "planar",
)
"""Suspended and fully constrained, large and small, spatial and planar, with pulleys or without."""
