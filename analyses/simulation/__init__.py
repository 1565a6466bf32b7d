"""A simulation on its way: advanced in pieces, its log put on disk, its state kept to go on from.

Whatever ends the program loses a few seconds of a run: the log grows on disk, and beside it stands
a checkpoint, the state of the whole diagram, see `systems.monitoring.state_arrays`. A run that is
continued from it comes to the same numbers as one that was never ended, bit for bit.

Picking and placing: runs of `systems.pick_and_place`, what they came to, and pictures of them.

Distances and angles are true ones, of the box in the plant against the goal where it truly is.

Many runs of one scenario: over seeds, in processes, kept in a folder, and what they came to.

One run of a scenario: simulation, summary, figures, files.

A run that another program follows and steers: it is shown samples and images, and says when to
pause, to step, how fast to go, and when to stop.

`cdpr simulate` is the program that runs; who started it, as the studio does, holds the other end of
a connection, see `messages`. A run is looked at between its steps and waits there: its numbers are
those of a run that nobody looks at.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
