"""How large errors may be before a servo's stability is lost: combinations of limits, item by item.

Every item is one question with its own name, depends on no other, and answers with a few numbers.

Source: servoing thesis 3.2 and 3.4.2.
"""

from cdpr_drake.analyses.studies.stability_ranges.figures import FIGURES
from cdpr_drake.analyses.studies.stability_ranges.study import JUDGES, study_stability_ranges

__all__ = ["FIGURES", "JUDGES", "study_stability_ranges"]
