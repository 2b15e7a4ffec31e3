"""Correctly rounded values: sums in double-double arithmetic where a bound cannot tell the nearest
complex64.
"""
