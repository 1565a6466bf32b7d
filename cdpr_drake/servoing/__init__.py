"""Visual servoing: from features in images to the twist of the platform and cable velocities.

**Features.** A feature vector s has the interaction matrix L with ds/dt = L V_C, V_C = (w, v) the
camera's twist in C against an object at rest. Rows of mixed features come rotation first. Every
interaction matrix has one home, `interaction_matrix_kernel`, which control and the analysis of
stability both call.

**Law.** V_C = L^+ (-lambda e + ds*/dt), turned into the platform's twist and from there into cable
velocities by the believed robot. Gains fall with the error, targets may move, features may follow
a plan. `ServoLaw.partition` takes the optical axis first, `ServoLaw.switching` chooses between pose
and image.

Source: servoing thesis 1.4 and 4.2, (4.2) for (1.60) and (1.61), whose sign is wrong; Chaumette and
Hutchinson, Visual servo control I, 2006, from which the exact forms are taken where the thesis'
differ; Chaumette, 2004, for ellipses.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
