"""The family of errors that cdpr_drake raises on purpose; each message is one line."""


class CdprError(Exception):
    """Base of all errors that a user can cause; the command line prints them and exits with 2."""


class DataFileError(CdprError):
    """A YAML file cannot be read: names the file, line, field, value found and accepted range."""


class RobotFileError(DataFileError):
    """A robot or camera file is unknown, malformed or describes an impossible robot."""


class ScenarioError(DataFileError):
    """A scenario file is unknown, malformed or asks for what its robot cannot do."""


class CableModelError(CdprError):
    """Constants or name of a cable model are not accepted; names the constant and the cable."""


class CableGeometryError(CdprError):
    """No cable can run from exit to anchor point at this pose; names the cable and why."""


class InfeasibleTensionError(CdprError):
    """No cable tensions within the bounds balance the wrench; names the pose or wrench."""


class TensionProblemError(CdprError):
    """A tension problem makes no sense, or a method does not apply to it; names what and why."""


class TrajectoryError(CdprError):
    """Poses and times make no motion; names the time or the number, and what is accepted."""


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


class ForwardKinematicsError(CdprError):
    """No pose near the guess has these cable lengths, or they do not determine one; by how much."""


class EquilibriumError(CdprError):
    """No pose of rest is found for these unstrained lengths; says what is left unbalanced."""


class OutputFolderError(CdprError):
    """Results cannot be written to the folder that was named."""


class RenderingError(CdprError):
    """The rendered camera cannot start; names the remedy."""


class StabilityError(CdprError):
    """A question about stability makes no sense; names the field, what was found and accepted."""


class VisualFeatureError(CdprError):
    """Visual features cannot control the motions that they should; says why."""


class WrenchSetError(CdprError):
    """A set of wrenches or accelerations is empty, unbounded or malformed; names the field."""


class WorkspaceError(CdprError):
    """A question about a workspace makes no sense; names the field, found and accepted values."""
