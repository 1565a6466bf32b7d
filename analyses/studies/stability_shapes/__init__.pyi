from .figures import FIGURES as FIGURES
from .statements import JUDGES as JUDGES
from .study import study_stability_shapes as study_stability_shapes
