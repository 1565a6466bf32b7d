"""Workspaces of robots: kinds and measures by name, the question, the sweep, figures, the page.

`KINDS` and `MEASURES` are the tables; a new kind is a row. Figures are imported when they are asked
for.

Source: Gazebo thesis 2.6; servoing thesis 1.2.2 and 1.3.3.

What questions over a grid of poses share: their grid, their run, their file, their numbers.

`cdpr stability` and `cdpr workspace` are such questions: each says its tasks and makes a result of
their arrays; how chunks are kept, found again and computed in processes or on a cluster is here.

Workspaces of stability: the question, the sweep over a grid, figures and the page.

Source: servoing thesis 3.3.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
