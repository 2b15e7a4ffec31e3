"""Slow parts of a target: computed at a few nodes in slow time and carried to every symbol with a bound."""
