"""Section `force_control` of dynamic control: how the platform answers forces."""
