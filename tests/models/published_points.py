"""Points that are printed, for tests of robots' files and of what is computed from them."""

LARGE_ANCHORS = [
    (0.0895, -0.087, 0.072),
    (-0.0895, 0.087, 0.0065),
    (-0.0895, -0.087, 0.072),
    (0.0895, 0.087, 0.0065),
    (-0.0895, 0.087, 0.072),
    (0.0895, -0.087, 0.0065),
    (0.0895, 0.087, 0.072),
    (-0.0895, -0.087, 0.0065),
]
"""Servoing thesis, table A.1."""
