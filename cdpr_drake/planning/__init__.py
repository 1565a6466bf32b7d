"""Programs about motion: the fastest law of time along a path, free paths, rest without swing.

A motion along a path s(t) asks the cables for tensions that are linear in u = d2s/dt2 and
x = (ds/dt)^2, with the redundancy as free variables; limits of tensions, torques, cable speeds and
accelerations make a convex set of (u, x) at every point of the path. Poses are X_WP; derivatives of
a path are spatial vectors (rotation, translation) in W, per metre of s.

Source: Bobrow, Dubowsky and Gibson, 1985; Pham and Stasse, 2015; Pham and Pham, 2018; Verscheure et
al., Time-optimal path tracking for robots: a convex optimization approach, 2009, in tests.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
