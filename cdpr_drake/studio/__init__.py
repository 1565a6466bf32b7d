"""The studio: a local web page for robots, poses, workspaces, runs and studies.

`serve` starts it. `session` is what a browser session works on; `pose` and `workspace` are a panel
each with what it shows. Its packages, from the bottom: `workbench` (files and work in child
processes), `panels` (a table of the page's panels, with their messages, fields and
bars). Only this package and `panels` know NiceGUI. Every session has a workbench of its own; all
sessions share the server's jobs, so that a reload or a second tab loses no run.

* `server` starts NiceGUI behind a `Guard`, and relays Drake's Meshcat to the same address. The
  guard asks for a cookie that `Entrance` gives for the token, and tells sessions by it.
* `Workbench` has what all tabs of a session show: the robot, a pose, and what is computed there. It
  knows no page; what shows it connects to its signals.
* `Document` is the robot as a text with undo and redo, changed only by what the checks accept.
* `PoseAnswer` is what is computed at the pose, by the verbs; `LiveWorkspace` the static workspace
  that follows a robot while it is changed. `RobotScene` draws both; `dragging.js` moves points.
* `Calculator` is the one thread that has kernels and Meshcat, so that a page never waits for a
  compiler; of several questions it answers the last.
* `Subject` is the robot and pose that a result is about; the page says above each panel what is
  about another one.
* `SchemaGroups` makes forms from schemas. `PANELS` is the table of panels; `PanelPages` sends the
  page with the panel that is shown, and imports the others once the browser is there.

Files are read and written below one folder.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
