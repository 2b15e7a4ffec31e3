"""Slow parts of a target are computed at a few nodes in slow time and interpolated to every symbol with a bound."""
