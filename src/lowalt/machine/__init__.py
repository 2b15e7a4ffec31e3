"""The machine that computes: compiled kernels, threads, memory, clocks, progress.

No stage is known here.
"""
