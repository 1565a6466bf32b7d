"""Design of robots: what may change, what is wanted, the search, and whether it came true.

A design is a vector of numbers in [0, 1], one a free coordinate; symmetries tie coordinates
together. It is judged as the robot file that it would be: points moved, cables left out, drum and
motor changed.

* `MovedPoints` makes displacements of points of the vector.
* `goals.GOALS` is the table of what may be wanted; volumes are shares of a grid of poses and steer
  the search only.
* `evolve` seeks the vector of the largest score by CMA-ES, which needs no gradients: shares of
  poses are steps of the coordinates.
* `climb` seeks the largest least of smooth functions by their slopes, which takes far fewer designs
  where a goal is such a least.
* `pareto_front` says which designs no other one is better than, where several values are wanted.
* `confirm` says what was gained, and knows nothing of the search: by boxes proven inside the
  workspace, or poses proven stable on another grid.

What a search knows can be replayed from the scores, so that it goes on where it was killed.

Source: kinds and measures of workspaces, and control stability, as `analyses.workspaces`; Hansen
and Ostermeier, Completely derandomized self-adaptation in evolution strategies, 2001, by the
package cmaes; Deb, Multi-objective optimization using evolutionary algorithms, 2001.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
