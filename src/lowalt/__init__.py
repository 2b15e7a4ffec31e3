"""lowalt: from meshes and motion to echoes, spectra, images, shards and a recogniser for the low sky.

One folder a stage, in pipeline order: targets, motion, echo, noise, spectra, tiles, shards, recognition, report.
"""

__version__ = "0.1.0"
