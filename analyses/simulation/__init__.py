"""Simulation of scenarios: one run, many runs, runs that go on after a stop or are steered.

* One run: simulation, summary, figures, files; `SCENARIO_KINDS` has the kinds of scenarios.
* A run on its way (`advance`): it is advanced in pieces. Its log grows on disk, and beside it
  stands a checkpoint, the state of the whole diagram, see
  `systems.monitoring.context_state.state_arrays`; so whatever ends the program loses a few seconds
  of a run. A run that is continued comes to the same numbers as one that was never ended, bit for
  bit.
* Runs of `systems.pick_and_place`: what they came to, and pictures of them. Distances and angles
  are true ones, of the box in the plant against the goal where it truly is.
* Many runs of one scenario (`run_many`): over seeds, in processes, kept in a folder, and what they
  came to.
* A run that another program follows and steers: that program is shown samples and images, and says
  when to pause, to step, how fast to go, and when to stop. `cdpr simulate` is the program that
  runs; who started it, as the studio does, holds the other end of a connection, see
  `live_messages`. A run is looked at between its steps and waits there: its numbers are those of a
  run that nobody looks at.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
