from .kernel_calls import array_addresses as array_addresses
from .linear_algebra_kernel import factor as factor
