"""Motion: random but reproducible motion parameters, and where they take every part of a target."""

from lowalt.motion.poses import Perturbation, Poses, poses, positions
from lowalt.motion.table import COLUMNS, read_table, write_table

__all__ = ["COLUMNS", "Perturbation", "Poses", "poses", "positions", "read_table", "write_table"]
