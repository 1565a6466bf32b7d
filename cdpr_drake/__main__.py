"""`python -m cdpr_drake` is the command `cdpr`."""

from cdpr_drake.cli.app import main

main()
