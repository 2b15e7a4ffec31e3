"""Which small faults can be set into a source file, and a random choice of them.

The faults are those of Cosmic Ray, a kept tool for mutation testing; only operators whose result a reader would call a
mistake are used (a sign, a comparison, a bound, a constant, a negated condition, a loop that never runs).
"""

from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator

_BINARY = ("Add_Sub", "Sub_Add", "Mul_Div", "Div_Mul", "FloorDiv_Mul", "Mod_FloorDiv", "Pow_Mul", "BitAnd_BitOr",
           "BitOr_BitAnd", "LShift_RShift", "RShift_LShift")  # fmt: skip
_COMPARISONS = ("Eq_NotEq", "NotEq_Eq", "Lt_LtE", "Lt_Gt", "LtE_Lt", "LtE_GtE", "Gt_GtE", "Gt_Lt", "GtE_Gt", "GtE_LtE",
                "Is_IsNot", "IsNot_Is")  # fmt: skip
_OTHERS = ("ReplaceUnaryOperator_Delete_USub", "ReplaceUnaryOperator_Delete_Not", "AddNot", "ReplaceTrueWithFalse",
           "ReplaceFalseWithTrue", "ReplaceAndWithOr", "ReplaceOrWithAnd", "ReplaceBreakWithContinue",
           "ReplaceContinueWithBreak", "NumberReplacer", "ZeroIterationForLoop")  # fmt: skip
OPERATORS = (
    *(f"core/ReplaceBinaryOperator_{name}" for name in _BINARY),
    *(f"core/ReplaceComparisonOperator_{name}" for name in _COMPARISONS),
    *(f"core/{name}" for name in _OTHERS),
)


class Mutant(NamedTuple):
    """A fault: file from the root of the repository, first line, operator, and which of its places in the file."""

    file: str
    line: int
    operator: str
    occurrence: int


@cache
def _operators() -> dict:
    """The operators of OPERATORS by name."""
    return {name: get_operator(name)() for name in OPERATORS}


def _shown_only(node) -> bool:
    """Whether a fault at a node can change no result: annotations, settings of a compiler, and `if __name__ ==`, whose
    block a test that imports the module never runs."""
    while node is not None:
        if node.type == "decorator" and "kernel" in node.get_code():
            return True
        if node.type == "if_stmt" and node.get_code().lstrip().startswith("if __name__"):
            return True
        above = node.parent
        if above is not None and above.type in ("tfpdef", "annassign") and node is above.children[-1]:
            return above.type == "tfpdef" or len(above.children) == 2
        node = above
    return False


def of_file(root: Path, file: str) -> list[Mutant]:
    """All faults that can be set into the file `file` below `root`, in the order of its lines.

    Source: Cosmic Ray's operators; BitOr in an annotation (`int | None`) is no operation and left out.
    """
    found, counts = [], dict.fromkeys(OPERATORS, 0)
    for node in ast_nodes(get_ast((root / file).read_text(encoding="utf-8"))):
        shown_only = _shown_only(node)
        for name, operator in _operators().items():
            for start, _ in operator.mutation_positions(node):
                if not shown_only:
                    found.append(Mutant(file, start[0], name, counts[name]))
                counts[name] += 1
    return sorted(found)


def draw(mutants: list[Mutant], count: int, generator: np.random.Generator) -> list[Mutant]:
    """`count` of the faults at most, drawn with equal chance, at most one a line of a file."""
    order = generator.permutation(len(mutants))
    lines, drawn = set(), []
    for index in order:
        mutant = mutants[index]
        if (mutant.file, mutant.line) not in lines and len(drawn) < count:
            lines.add((mutant.file, mutant.line))
            drawn.append(mutant)
    return drawn


def mutated(source: str, mutant: Mutant) -> str:
    """The text of a file with the fault set in.

    Raises ValueError where the file has no such place.
    """
    text = mutate_code(source, get_operator(mutant.operator)(), mutant.occurrence)
    if text is None or text == source:
        raise ValueError(f"{mutant.file}: no place {mutant.occurrence} of {mutant.operator}")
    return text
