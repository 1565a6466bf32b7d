"""The process that compiles beside a command."""

from cdpr_drake.kernel_cache.helper import main

main()
