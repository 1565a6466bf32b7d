from .batch import distribute_batch as distribute_batch
from .closed_form_kernel import closed_form as closed_form
from .methods import METHODS as METHODS
from .methods import Distributor as Distributor
from .methods import TensionMethod as TensionMethod
from .methods import distribute as distribute
from .program import make_program as make_program
from .program import program_tensions as program_tensions
