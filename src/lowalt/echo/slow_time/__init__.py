"""Slow parts of a target: computed at a few nodes in slow time and interpolated to every symbol with a bound."""
