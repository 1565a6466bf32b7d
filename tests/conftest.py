"""Settings that all tests share."""

from hypothesis import settings

# Kernels compile at their first call, so time says nothing; and a run that fails, fails again.
# Examples at random: `pytest --hypothesis-profile=random`.
settings.register_profile("random", deadline=None, max_examples=500)
settings.register_profile("same", deadline=None, derandomize=True)
settings.load_profile("same")
