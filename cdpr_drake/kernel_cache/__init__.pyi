from .background import compile_in_background as compile_in_background
from .background import compile_needed as compile_needed
