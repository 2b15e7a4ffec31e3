"""Numbers whose bits are the same on every processor.

Elementary functions, exact sums, random draws.
"""
