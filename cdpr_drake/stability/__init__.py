"""Where a visual servo converges although its model is wrong.

The closed loop is de/dt = -lambda Pi e with Pi = L J^+ J_hat L_hat^+ for features e, the true
robot without and the believed robot with a hat. The error falls where the symmetric part of Pi is
positive definite.

* **What is asked**: `StabilityCase`; `desired_view` says what a servo sees and wants at each pose.
* **How wrong the model may be**: `perturbation_bounds`, and draws within them by
  `perturbation_samples_kernel`. A perturbation is a vector of 18 + 6 m numbers: platform pose,
  camera pose, object pose (rotation vector [rad], translation [m] each), exit points and anchor
  points [m].
* **Pi at a pose**: `criterion` is the plain form that the kernels are tested against;
  `criterion_kernel` and its like are those kernels, with the gradient, and
  `criterion_closed_forms` has the cases in which the robot's model is exact.
* **Verdicts on poses**, of growing weight: sampled, searched, certified, by `judge_stability`. The
  proof behind the last one stands in the room `proofs`.

Source: servoing thesis chapter 3: (3.1), (3.8), (3.26) and 3.4 for the criterion, with e in the
lever of PBVS as its analysis has it, or the exact matrix, see `OBJECT_POSE_MODELS`; 3.2 and
tables A.8 to A.18 for perturbations; 3.3 for sampling.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
