"""The family of errors that cdpr_drake raises on purpose.

A message is one line; of a file that has several problems, one line for each.
"""

from __future__ import annotations

import difflib
import unicodedata
from collections.abc import Iterable

LEAST_ALIKE = 0.65
"""How alike a name must be to one that was meant, of 1 [-]; "magic" and "image" are by 0.6."""

MOST_PROBLEMS = 20
"""Problems of one file that are said; who has more begins with these."""


def meant_names(found: object, known: Iterable[object]) -> list[str]:
    """The known name that was probably meant by one that is unknown; none where none is close."""
    return difflib.get_close_matches(str(found), [str(name) for name in known], 1, LEAST_ALIKE)


def plain_words(words: str) -> str:
    """Words for a terminal: what would control it, as in the name of a file, is escaped.

    Ends of lines and tabs stay.
    """
    if words.isprintable():
        return words
    return "".join(
        repr(c)[1:-1] if unicodedata.category(c) in _CONTROLS and c not in "\n\t" else c
        for c in words
    )


_CONTROLS = ("Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp")


def why_not_read(problem: Exception) -> str:
    """Why a file cannot be read, in the system's words, without the path that the message has."""
    return str(getattr(problem, "strerror", None) or problem)


def accepted_names(found: object, known: Iterable[object]) -> str:
    """Words that follow "found X; ": the name that was probably meant, and all that are accepted.

    Args:
        found: The name that was found, which is not among them.
        known: Those that are accepted, in the order in which they are said.
    """
    names = [str(name) for name in known]
    hint = "".join(f"did you mean {name}? " for name in meant_names(found, names))
    return f"{hint}accepted: {', '.join(names)}"


def install_words(extra: str) -> str:
    """How an extra of this package is installed; the package itself comes from its sources."""
    return f"in its sources: pip install '.[{extra}]'"


class CdprError(Exception):
    """Base of all errors that a user can cause; the command line prints them and exits with 2."""


class DataFileError(CdprError):
    """A YAML file cannot be read: names the file, line, field, value found and accepted range."""

    def __init__(self, *problems: str) -> None:
        """With one line or several."""
        super().__init__(*problems)

    @property
    def problems(self) -> tuple[str, ...]:
        """Everything that was found, each in one line; the message has a line for each."""
        return self.args

    def __str__(self) -> str:
        """The problems, one a line."""
        return "\n".join(self.problems)

    def within(self, where: str) -> tuple[str, ...]:
        """The problems, with words before each that say where it is."""
        return tuple(f"{where}: {problem}" for problem in self.problems)


class Problems:
    """Collects what is wrong with a file, so that all of it is said at once."""

    def __init__(self, error: type[DataFileError]) -> None:
        """With the class of the error that is raised in the end."""
        self._error = error
        self._found: list[str] = []

    def add(self, *problems: str) -> None:
        """Notes problems, and raises at once where there are more than anybody reads.

        Raises:
            DataFileError: There are `MOST_PROBLEMS`; of the class that was given.
        """
        self._found += problems
        if len(self._found) >= MOST_PROBLEMS:
            self._found[MOST_PROBLEMS:] = ["there may be more problems than these"]
            self.raise_any()

    def raise_any(self) -> None:
        """Raises what was found, if anything.

        Raises:
            DataFileError: With all problems; of the class that was given.
        """
        if self._found:
            raise self._error(*self._found)


class RobotFileError(DataFileError):
    """A robot or camera file is unknown, malformed or describes an impossible robot."""


class ScenarioError(DataFileError):
    """A scenario file is unknown, malformed or asks for what its robot cannot do."""


class WorldError(CdprError):
    """A body of the world makes no sense or its file cannot be read; names the key, and why."""


class CableModelError(CdprError):
    """Constants or name of a cable model are not accepted; names the constant and the cable."""


class CableGeometryError(CdprError):
    """No cable can run from exit to anchor point at this pose; names the cable and why."""


class DivergedError(CdprError):
    """A motion has no finite numbers any more; names the time and the step."""


class InfeasibleTensionError(CdprError):
    """No cable tensions within the bounds balance the wrench; names the pose or wrench."""


class TensionProblemError(CdprError):
    """A tension problem makes no sense, or a method does not apply to it; names what and why."""


class TrajectoryError(CdprError):
    """Poses and times make no motion; names the time or the number, and what is accepted."""


class PlanningError(CdprError):
    """No motion keeps the limits, or a question makes no sense; names the place and the cable."""


class ControlGainError(CdprError):
    """A gain of a controller is not accepted; names it, what was found and accepted."""


class BoundsFileError(DataFileError):
    """A file of perturbation bounds is unknown or malformed."""


class WorkspaceGridError(CdprError):
    """A grid of poses has no points or makes no sense; names the axis and what it found."""


class SensorError(CdprError):
    """A sensor is asked for what it cannot do; names the field, what was found and accepted."""


class SweepError(CdprError):
    """A sweep cannot start or go on: a scheduler does not answer, or a worker died."""


class StoppedError(CdprError):
    """Work was asked to stop before there was a result; says how far it was."""


class ForwardKinematicsError(CdprError):
    """No pose near the guess has these cable lengths, or they do not determine one; by how much."""


class EquilibriumError(CdprError):
    """No pose of rest is found for these unstrained lengths; says what is left unbalanced."""


class OutputFolderError(CdprError):
    """Results cannot be written to the folder that was named."""


class CheckpointError(CdprError):
    """A run cannot be continued: its checkpoint is missing, damaged, or that of another run."""


class OutputFormatError(CdprError):
    """A format is unknown, cannot hold what is asked, or needs what is not installed."""


class RenderingError(CdprError):
    """The rendered camera cannot start; names the remedy."""


class MeshcatError(CdprError):
    """Meshcat cannot listen where it was asked to; names the host or port, and what is accepted."""


class StabilityError(CdprError):
    """A question about stability makes no sense; names the field, what was found and accepted."""


class VisualFeatureError(CdprError):
    """Visual features cannot control the motions that they should; says why."""


class LensDistortionError(CdprError):
    """A lens folds its image over, or has coefficients that none has."""


class CameraCalibrationError(CdprError):
    """Images do not tell the camera that took them; says which, or why."""


class DesignError(DataFileError):
    """A search for a design makes no sense; names file, field, found and accepted values."""


class WrenchSetError(CdprError):
    """A set of wrenches or accelerations is empty, unbounded or malformed; names the field."""


class WorkspaceError(CdprError):
    """A question about a workspace makes no sense; names the field, found and accepted values."""


class BridgeError(CdprError):
    """A process outside cannot be reached, or its message is not accepted; says what was found."""


class ClientEndedError(CdprError):
    """The process outside that closes a run's loop is gone, silent, or makes no sense any more.

    Attributes:
        exit_code: Of a command that ends with it.
    """

    exit_code = 4


class IdentificationError(CdprError):
    """An identification is asked for what its logs do not hold or cannot tell; names what, why."""


class CalibrationError(CdprError):
    """A calibration is asked for what its data do not hold or cannot tell; names what and why."""


class ClockError(CdprError):
    """Two recordings cannot be told to be of one motion, or at which shift; says why."""


class LogFileError(CdprError):
    """A log of a machine cannot be read: names file, line or column, what was found, accepted."""
