"""Why a scenario needs a diagram."""
