"""The servoing thesis' case studies of pose estimation and servoing, I to VIII and A.6."""
