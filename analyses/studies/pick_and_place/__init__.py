"""Study: a box is taken and set down by what cameras see, with its goal in view and hidden.

`study_pick_and_place` runs `acrobot_pick_and_place` over seeds, which say where box and goal truly
are and what the robot believes wrongly: with the goal's tag in view, hidden on the way, hidden
while the box is lowered, and with the camera alone that the box blinds.

Source: servoing thesis 5.4, perspectives; the numbers that have to be reached are ours.
"""

from cdpr_drake.analyses.studies.pick_and_place.statements import JUDGES
from cdpr_drake.analyses.studies.pick_and_place.study import (
    PickAndPlaceStudy,
    study_pick_and_place,
)

__all__ = ["JUDGES", "PickAndPlaceStudy", "study_pick_and_place"]
