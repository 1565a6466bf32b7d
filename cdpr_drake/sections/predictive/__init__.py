"""Section `predictive` of dynamic control: tensions by a program over the time ahead."""
