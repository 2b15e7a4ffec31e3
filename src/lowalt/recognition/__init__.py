"""Recognition: from shards to a trained fusion network, its predictions and the paper's tables.

Only `network`, `training`, `inference` and `export` import torch; everything about samples, tables and
statistics runs without it.
"""
