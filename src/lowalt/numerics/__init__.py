"""Numbers whose bits are the same on every processor: elementary functions, exact sums, random
draws.
"""
