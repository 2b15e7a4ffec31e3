"""Shards: deterministic WebDataset tars, their tables and index, checks, and map-style reading."""

from lowalt.shards.read import ShardSet
from lowalt.shards.verify import faults

__all__ = ["ShardSet", "faults"]
