"""Correctly rounded values: double-double sums where a bound cannot tell the nearest complex64."""
