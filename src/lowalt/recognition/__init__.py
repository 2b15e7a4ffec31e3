"""Recognition: from shards to a trained fusion network, its predictions and the paper's tables.

Samples, schemes, predictions, tables and statistics do not import torch. Networks and their
training do.
"""
