"""The pointwise kernel: reference range, terms of every point, sums over points.

It serves any geometry and array.
"""
