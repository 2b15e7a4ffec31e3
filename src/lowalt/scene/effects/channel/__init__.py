"""Effects between the antennas and the target: amplitudes, paths, physics of waves, further echoes
and signals.
"""
