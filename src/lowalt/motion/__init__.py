"""Motion: random but reproducible motion parameters, and where they take every part of a target."""

from lowalt.motion.perturbation import Perturbation, combined
from lowalt.motion.poses import Poses, poses, positions
from lowalt.motion.table import COLUMNS, read_table, write_table

__all__ = ["COLUMNS", "Perturbation", "Poses", "combined", "poses", "positions", "read_table", "write_table"]
