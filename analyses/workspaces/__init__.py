"""Workspaces of robots over grids of poses: which poses are inside, and measures of those.

* Grids of poses: what `cdpr stability` and `cdpr workspace` share. Each says its tasks and makes a
  result of their arrays; how chunks are kept, found again and computed in processes or on a cluster
  is here, and so are the grid, the results' file and their numbers.
* Workspaces of a robot (`cdpr workspace`): `KINDS` and `MEASURES` of `conditions` are the tables of
  kinds and measures by name; a new kind is a row.
* Workspaces of control stability (`cdpr stability`): where a visual servo is stable.

Each of the two has its question, its sweep over the grid, its figures and its page. Figures are
imported when they are asked for.

Source: workspaces: Gazebo thesis 2.6, servoing thesis 1.2.2 and 1.3.3; control stability:
servoing thesis 3.3.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
