"""Section `wrench_estimation`: an estimate of what pushes the platform beside its cables."""
