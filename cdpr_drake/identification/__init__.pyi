from .excitation import design_excitation as design_excitation
from .program import IdentificationProgram as IdentificationProgram
from .regressor import inertia_regressor as inertia_regressor
from .samples import sample_motion as sample_motion
from .swings import fit_swings as fit_swings
