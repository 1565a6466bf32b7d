from .figures import FIGURES as FIGURES
from .statements import CHECKS as CHECKS
from .study import study_stability_shapes as study_stability_shapes
