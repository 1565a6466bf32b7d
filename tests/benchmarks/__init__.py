"""Times against other software in one run, by hand: `python -m tests.benchmarks`, one file a peer.

Absolute times say little on another machine, so each way to compute is timed in turns with the one
that it is compared with. Nothing here is a test, and no time is asserted anywhere.
"""
