"""What one browser session works on."""

from __future__ import annotations

from pydrake.geometry import Meshcat

from cdpr_drake.analyses.pictures import open_meshcat
from cdpr_drake.models import Robot, robot_text
from cdpr_drake.studio.jobs import JobManager
from cdpr_drake.studio.workbench.document import Document, robot_document
from cdpr_drake.studio.workbench.signal import Signal
from cdpr_drake.studio.workbench.working_folder import WorkingFolder

USUAL_ROBOT = "acrobot_large"


class Workbench:
    """What one browser session works on; its tabs show the same.

    Attributes:
        folder: Where files are read and written.
        robot: The robot's document.
        file: Name of the robot's file in the folder; empty: it has none yet.
        scenario: Name or path of the scenario that is worked with; empty: none was chosen.
        scenario_chosen: Called when there is another one.
        panel: Name of the panel that was shown last.
        dark: Whether the page is dark; None: as the browser likes it.
        jobs: Work in processes of its own, the same for all sessions of a server.
    """

    def __init__(
        self,
        folder: WorkingFolder,
        robot: str = USUAL_ROBOT,
        scenario: str = "",
        *,
        jobs: JobManager | None = None,
    ) -> None:
        """With a robot of the package or the path of a file, and perhaps a scenario.

        Raises:
            CdprError: There is no such robot, or it is not accepted.
        """
        self.folder = folder
        self.robot: Document[Robot] = robot_document(robot_text(robot), robot)
        self.file = ""
        self.scenario, self.scenario_chosen = scenario, Signal()
        self.panel = ""
        self.dark: bool | None = None
        self.jobs = JobManager() if jobs is None else jobs
        self._meshcat: Meshcat | None = None

    def choose_scenario(self, scenario: str) -> None:
        """Works with another scenario from now on."""
        self.scenario = scenario
        self.scenario_chosen.emit()

    @property
    def meshcat(self) -> Meshcat:
        """The scene, on a port of this machine; the server relays it to the page."""
        if self._meshcat is None:
            self._meshcat = open_meshcat()
        return self._meshcat
