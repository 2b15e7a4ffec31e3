"""Numbers whose bits are the same on every processor.

They come from elementary functions, exact sums and random draws.
"""
