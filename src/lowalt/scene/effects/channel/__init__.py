"""Effects between the antennas and the target.

They are amplitudes, paths, physics of waves, further echoes and signals.
"""
