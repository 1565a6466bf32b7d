"""Workspaces: grids of poses, what holds at each, volume and surface of where it holds.

Functions take arrays of poses and any number of rows that the platform can move, six or fewer;
moments and turns are compared with forces and translations by a length, `StaticCase.arm`.

**Grids, volumes, surfaces**: `pose_grid`, `volume`, `hull`, `mesh_files`. A grid is a box of
positions times a list of orientations. Volumes come by three rules, named in every result.

**Wrenches**: which ones cables can give at a pose, and whether these are the ones that are asked
for. The tensions lower <= t <= upper give the wrenches W t, a zonotope (`available_wrenches`). A
pose is feasible where all wrenches that are demanded of the cables, `demanded_wrenches`, lie in it:
to bear the weight (static), to resist a set of wrenches too (wrench-feasible), or to accelerate the
platform (dynamic). Where tensions without upper limits give every wrench, the pose has wrench
closure. `wrench_capacity` says by how much.

**What else makes a pose good**: stiffness and vibrations (`stiffness`), dexterity and an even share
of the load (`tension_factor`). The platform is held by the tensions of least 2-norm where a number
depends on them.

**What cables and platform meet**: distances between straight cables, boxes and convex shapes, exact
(`cable_interference`). The platform and the beams of the frame are boxes, obstacles these or convex
shapes; a cable is a segment with a radius. Next to its ends a cable touches what carries it, so a
length there is left out by name.

What holds at every pose of a box or cell is proven in the room `proofs`.

Source: Gazebo thesis 2.5 and 2.6; servoing thesis 1.2.2, (1.25), 1.2.4 and 1.3.3; Bosscher, Riechel
and Ebert-Uphoff, Wrench-feasible workspace generation for cable-driven robots, 2006; Pham et al.,
2009; Perreault et al., 2010; Ericson, Real-Time Collision Detection, 2005.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
