"""A town: buildings from a file, and the paths of waves among them.

Waves go between a station and a target.
"""
