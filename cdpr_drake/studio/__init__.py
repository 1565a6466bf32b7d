"""The studio: a local web page for robots, poses, workspaces, runs, studies and all commands.

`serve` starts it. `server` starts NiceGUI behind a `Door`, which asks for a cookie that whoever has
the token gets, and tells sessions by it; Drake's Meshcat is relayed to the same address.
`page` is the page, `panel` the table of its panels with what connects them to a workbench.
`session` is what a browser session works on. `robot`, `pose`, `workspace`, `run`, `logs` and
`verb_panel` are the panels.

* `Workbench` has what all tabs of a session show: the robot, a pose, and what is computed there. It
  knows no page; what shows it subscribes to its events.
* `Document` is a robot or scenario as a text with undo and redo, changed only by what the checks
  accept. `SettingsForm` is its form, made from the declarations of its settings.
* `Verb` is a command as its verb declares it, `VerbForm` its form. A `VerbPanel` starts verbs and
  shows what they leave in a folder (`Board`); four of the panels are one each, of `Verbs`.
* `PoseAnswer` is what is computed at the pose, by the verbs; `LiveWorkspace` the static workspace
  that follows a robot while it is changed. `RobotScene` draws both; `dragging.js` moves points.
* `Workbench.calculator` is the one thread that has kernels and Meshcat, so that a page never waits
  for a compiler; of several questions it answers the last.
* `Subject` is the robot and pose that a result is about; the page says above each panel what is
  about another one.
* `View` shows what any command left: numbers, verdicts, tables, figures, pages, files. `RunPanel`
  shows a run that goes on (`RunJob`) and one that is finished (`FinishedRun`) alike.
* `Job` is any `cdpr` command in a process of its own. All sessions share the server's jobs, so that
  a reload or a second tab loses no run.

Files are read and written below one folder.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
