"""Visual servo of a camera on any link of a plant on cables.

    V_C = -lambda(|e|) L^+ e,   e = s - s*                  twist of the camera against the object
    v_s = (J_C S)^+ (V_C - J_C (1 - S S') v),               velocities of the joints that it moves
    l_dot = J_l (S v_s + (1 - S S') v)

with J_C the plant's Jacobian of the camera's spatial velocity in C, S the columns of the joints
that the servo moves, and v the velocities of all others, as the plant has them: bases that drive on
meanwhile are accounted for.

Source: Chaumette and Hutchinson, Visual servo control I, IEEE Robotics and Automation Magazine
13(4), 2006, (5); servoing thesis (1.31), (1.35), for a platform.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, JacobianWrtVariable
from pydrake.systems.framework import Context, DiscreteStateIndex, DiscreteValues, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.errors import VisualFeatureError
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_rest import rows_of_joints, rows_of_motors
from cdpr_drake.servoing.servo_law import AdaptiveGain
from cdpr_drake.servoing.servo_task import ServoTask
from cdpr_drake.servoing.visual_features import sighting


class LinkServo(LeafSystem):
    """Moves cables so that a camera on a link sees its target as desired.

    ================ =============== =========== ==============================================
    port             type            unit        meaning
    ================ =============== =========== ==============================================
    X_CO             RigidTransform  m           in, object in the camera frame
    found            vector(1)       -           in, 1 where the object is seen
    marks            vector(k)       -           in, image of the marks, (x, y) of each in turn, or
                                                 whatever the features take, row by row
    plant_state      vector(nq + nv) m, rad      in, positions and velocities as they are believed
    cable_velocities vector(m)       m/s         out, positive pays out; 0 while nothing is seen
    camera_twist     vector(6)       rad/s, m/s  out, V_C that is asked for, (w, v) in C
    error            vector(e)       -, m, rad   out, s - s*; NaN while nothing is seen
    ================ =============== =========== ==============================================

    Samples its inputs at a rate of its own. Velocities in `plant_state` of joints that it does not
    move are best the commanded ones: measured ones close a loop through elastic cables, which can
    be unstable.
    """

    def __init__(
        self,
        cables: PlantCables,
        camera: tuple[Frame, RigidTransform],
        task: ServoTask,
        gain: AdaptiveGain,
        rate: float,
        *,
        marks: tuple[int, int] = (2, 0),
        moves: Iterable[str] | None = None,
    ) -> None:
        """For cables of a finalized plant.

        Args:
            cables: The cables, as the servo believes them to be.
            camera: Where it is mounted: a frame F of the plant, and X_FC [m], C with z ahead and
                x to the right of the image.
            task: Features and what they shall be, from `servoing.make_task`.
            gain: lambda.
            rate: Images per second [Hz].
            marks: Shape of `Sighting.marks`; (2, 0): the features need none.
            moves: Joints that the servo moves, by name; None: those without an actuator.

        Raises:
            VisualFeatureError: The rate makes no sense, or the joints that it moves do not move the
                camera.
            EquilibriumError: There is no such joint.
        """
        super().__init__()
        plant = cables.plant
        if not (np.isfinite(rate) and rate > 0.0):
            raise VisualFeatureError(f"rate: found {rate:g}; accepted: above 0 [Hz]")
        self._cables, self._plant, self._camera = cables, plant, camera
        self._task, self._gain, self._marks_shape = task, gain, marks
        self._own = plant.CreateDefaultContext()
        moved = ~rows_of_motors(plant) if moves is None else rows_of_joints(plant, moves)
        self._columns = np.flatnonzero(moved)
        if not np.any(camera_jacobian(plant, self._own, camera)[:, self._columns]):
            raise VisualFeatureError(
                f"camera on {camera[0].body().name()}: found no joint among those that the servo "
                "moves which moves it; accepted: a link that they carry"
            )
        size = marks[0] * marks[1]
        states = plant.num_multibody_states()
        self._X_CO = self.DeclareAbstractInputPort("X_CO", Value(RigidTransform())).Eval
        self._found = self.DeclareVectorInputPort("found", 1).Eval
        self._marks = self.DeclareVectorInputPort("marks", size).Eval if size else None
        self._state = self.DeclareVectorInputPort("plant_state", states).Eval
        k = len(task.final)
        self._answers = []
        for name, value in (
            ("cable_velocities", np.zeros(cables.routes.count)),
            ("camera_twist", np.zeros(6)),
            ("error", np.full(k, np.nan)),
        ):
            index = int(self.DeclareDiscreteState(value))
            self._answers.append(index)
            self.DeclareStateOutputPort(name, DiscreteStateIndex(index))
        self.DeclarePeriodicDiscreteUpdateEvent(1.0 / rate, 0.0, self._update)
        self.DeclareForcedDiscreteUpdateEvent(self._update)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        velocities, twist, error = map(state.get_mutable_value, self._answers)
        if self._found(context)[0] < 0.5:
            velocities[:], twist[:], error[:] = 0.0, 0.0, np.nan
            return
        marks = np.zeros(self._marks_shape)
        if self._marks is not None:
            rows, count = self._marks_shape
            flat = np.array(self._marks(context))
            marks = flat.reshape(count, rows).T if rows == 2 else flat.reshape(rows, count)
        s, L = self._task.features.evaluate(sighting(self._X_CO(context), marks))
        error[:] = s - self._task.final
        wanted = -self._gain(error) * error
        twist[:] = np.linalg.pinv(self._task.chosen_interaction(L)) @ wanted
        velocities[:] = self._cable_velocities(self._state(context), twist)

    def _cable_velocities(self, state: Array, V_C: Array) -> Array:
        plant, own = self._plant, self._own
        plant.SetPositionsAndVelocities(own, state)
        J_C = camera_jacobian(plant, own, self._camera)
        v = np.array(state[plant.num_positions() :])
        v[self._columns] = 0.0
        rest = V_C - J_C @ v
        v[self._columns] = np.linalg.lstsq(J_C[:, self._columns], rest, rcond=None)[0]
        return self._cables.length_jacobian(own) @ v


def camera_jacobian(
    plant: MultibodyPlant, context: Context, camera: tuple[Frame, RigidTransform]
) -> Array:
    """J_C with V_C = J_C v, the camera's twist (w, v) against W, in C, shape (6, nv).

    Args:
        plant: The plant.
        context: Of the plant.
        camera: The frame that carries it and its pose there, see `LinkServo`.
    """
    frame, X_FC = camera
    J = plant.CalcJacobianSpatialVelocity(
        context, JacobianWrtVariable.kV, frame, X_FC.translation(), plant.world_frame(), frame
    )
    R_CF = X_FC.rotation().matrix().T
    return np.vstack([R_CF @ J[:3], R_CF @ J[3:]])
