"""Rooms whose bytes are promised use no function whose last bit depends on the processor or on a
library.
"""

import ast
from pathlib import Path

import pytest

TARGETS = (
    "aircraft",
    "assemble",
    "bird",
    "builtin",
    "cyclist",
    "gait",
    "gait_run",
    "gait_walk",
    "quadruped",
    "skeleton",
    "surfaces",
    "uav",
    "uav_pieces",
    "vehicle",
)
ROOT = Path(__file__).parent.parent / "src/lowalt"
FILES = sorted(
    [
        *(ROOT / f"targets/{name}.py" for name in TARGETS),
        *ROOT.glob("motion/*.py"),
        *ROOT.glob("noise/*.py"),
    ]
)
FIXED = {
    "sqrt",
    "floor",
    "ceil",
    "isqrt",
    "fabs",
    "isfinite",
    "isinf",
    "isnan",
    "copysign",
    "radians",
    "degrees",
}
"""Functions of `math` that IEEE 754 or whole numbers fix."""
DEPENDS = {
    "sin",
    "cos",
    "tan",
    "arcsin",
    "arccos",
    "arctan",
    "arctan2",
    "sinh",
    "cosh",
    "tanh",
    "exp",
    "exp2",
    "expm1",
    "log",
    "log2",
    "log10",
    "log1p",
    "power",
    "float_power",
    "cbrt",
    "hypot",
    "dot",
    "matmul",
    "einsum",
    "inner",
    "interp",
    "norm",
    "inv",
    "solve",
    "svd",
    "eigh",
    "lstsq",
}
"""Functions of NumPy that are other code on other processors, or that sum in an order of their own.
"""
ALLOWED = {("surfaces.py", "arctan2"), ("drawing.py", "hypot"), ("poses.py", "@")}
"""Turns around a point and a mast's clearance are only held against a limit; places of all points
are for scenes with effects, whose bytes are not promised."""


def loose(text: str) -> list[str]:
    """The functions and operators of a module's text whose last bit is not fixed."""
    found = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.MatMult):
            found.append("@")
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
            whole = isinstance(node.left, ast.Constant) and isinstance(node.left.value, int)
            square = isinstance(node.right, ast.Constant) and node.right.value == 2
            found += [] if whole or square else ["**"]
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name | ast.Attribute):
            library = ast.unparse(node.value)
            of_numpy = library in ("np", "numpy", "np.linalg") and node.attr in DEPENDS
            of_math = (
                library == "math"
                and node.attr not in FIXED
                and node.attr not in ("pi", "inf", "nan", "tau")
            )
            found += [node.attr] if of_numpy or of_math else []
    return found


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_a_room_whose_bytes_are_promised_uses_portable_functions(path):
    """NumPy's cube of an array was another number with AVX-512 than without."""
    assert not [name for name in loose(path.read_text()) if (path.name, name) not in ALLOWED]


def test_each_way_to_a_loose_last_bit_is_found():
    text = (
        "a = x**3 + x**0.5 + 2**n + x**2\nb = np.sin(x) @ y\nc = math.exp(1) + math.sqrt(2) +"
        " np.linalg.norm(x)"
    )
    assert sorted(loose(text)) == ["**", "**", "@", "exp", "norm", "sin"]
