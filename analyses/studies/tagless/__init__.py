"""Study: servoing on textured squares without tags beside tags of the same size.

`study_tagless` runs ACROBOT's approach in rendered images from starts that are drawn, on a tag and
on each texture, by three schemes, and compares where the platform comes to rest with where it
should be.
"""

from cdpr_drake.analyses.studies.tagless.statements import JUDGES
from cdpr_drake.analyses.studies.tagless.study import TaglessStudy, study_tagless

__all__ = ["JUDGES", "TaglessStudy", "study_tagless"]
