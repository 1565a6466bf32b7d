from .beside import compile_beside as compile_beside
from .helper import compile_needed as compile_needed
