"""No compiled kernel of a stage whose bytes are promised lets a compiler fuse or reorder, on ARM as
on x86-64.

A fused multiply-add rounds once where a product and a sum round twice. LLVM fuses only what the
code it gets allows: by flags on an operation or by the intrinsic `fmuladd`. ARM processors always
have the instruction, so the machine code that the same compiler makes for one is looked at too,
without running it.
"""

import importlib
import re

import numpy as np
import pytest
from numba import njit

from lowalt.machine.jit import Kernel

llvm = pytest.importorskip("llvmlite.binding")

# The stages whose stored values are not rounded afterwards from a bound, as the echo's are.
MODULES = (
    "numerics.exact.arithmetic",
    "numerics.exact.sines",
    "echo.rounding.nearest",
    "echo.rounding.sums",
    "motion.pose_kernels",
    "numerics.large_matrices",
    "numerics.normals",
    "scene.antenna",
    "scene.response_loops",
    "scene.spherical",
    "scene.view",
    "spectra.sliding",
    "tiles.huffman",
    "tiles.huffman_code",
    "tiles.pixels",
    "tiles.png",
    "tiles.resample",
)
LOOSE = re.compile(
    r"\bf(?:add|sub|mul|div|neg) (?:(?:nnan|ninf|nsz|arcp|afn) "
    r")*(?:fast|contract|reassoc)\b|@llvm\.fmuladd"
)
LIBRARY = re.compile(r"call .*@(?:llvm\.|numba_)?(?:sin|cos|tan|exp|log|pow|hypot|atan)\w*[.(]")
FUSED = re.compile(r"\b(?:fn?madd|fn?msub|fmla|fmls)\b")
LINE = "float32[::1]"
TABLE = "float32[:, ::1]"
SIGNATURES = {
    ("motion.pose_kernels", "_product"): "float64[:, ::1], float64[:, ::1], float64[:, ::1]",
    ("motion.pose_kernels", "_sines"): "float64[::1], float64[::1], float64[::1]",
    ("numerics.normals", "fill"): "uint64[::1], float64, float64[:, ::1], float64[:, ::1]",
    (
        "spectra.sliding",
        "fourier_magnitudes",
    ): f"{LINE}, {LINE}, int64, int64, {LINE}, {LINE}, {TABLE}",
    ("spectra.sliding", "transfer"): f"{LINE}, {LINE}, int64, {TABLE}, {TABLE}, {LINE}, {TABLE}",
    (
        "tiles.pixels",
        "index_image",
    ): f"{TABLE}, boolean, int32, int32, int32[::1], int32[::1], uint8[:, ::1]",
    ("tiles.resample", "along_rows"): f"{TABLE}, uint64[:, ::1], {TABLE}, {TABLE}",
    ("tiles.resample", "across_rows"): f"{TABLE}, int64[:, ::1], {TABLE}, {TABLE}",
}
"""Kernels with much floating-point work, and the types that their stages give them."""
FREE = (
    ("motion.pose_kernels", "_product"),
    ("tiles.resample", "along_rows"),
    ("tiles.resample", "across_rows"),
)
"""Those of them that hold no memory of their own: their code has nothing in it that only x86-64
knows.
"""


def kernels(name: str) -> dict[str, Kernel]:
    """The compiled functions that a module of the package defines."""
    module = importlib.import_module(f"lowalt.{name}")
    found = {key: value for key, value in vars(module).items() if isinstance(value, Kernel)}
    return {
        key: value for key, value in found.items() if value.function.__module__ == module.__name__
    }


def code(function, signature: str, **options) -> str:
    """The code that LLVM gets and has improved, compiled anew: kept machine code cannot be
    inspected.
    """
    fresh = njit(**options)(function)
    fresh.compile(f"void({signature})")
    return next(iter(fresh.inspect_llvm().values()))


def options_of(kernel: Kernel) -> dict:
    """The settings of a kernel that decide about its arithmetic."""
    return {
        key: kernel.options[key] for key in ("fastmath", "error_model") if key in kernel.options
    }


def for_arm(text: str) -> str:
    """Assembly of such code for an ARM server processor."""
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    target = llvm.Target.from_triple("aarch64-unknown-linux-gnu")
    text = re.sub(r"target (?:triple|datalayout) = .*", "", text)
    text = re.sub(r'"target-(?:cpu|features)"="[^"]*"', "", text)
    machine = target.create_target_machine(cpu="neoverse-n1", opt=3)
    return machine.emit_assembly(llvm.parse_assembly(text))


@pytest.mark.parametrize("name", MODULES)
def test_kernels_allow_neither_fusing_nor_reordering(name):
    found = kernels(name)
    assert found
    loose = {key for key, kernel in found.items() if kernel.options.get("fastmath", False)}
    assert not loose


@pytest.mark.parametrize(("name", "key"), SIGNATURES)
def test_the_code_of_kernels_has_no_loose_operation_and_no_library_function(name, key):
    kernel = kernels(name)[key]
    text = code(kernel.function, SIGNATURES[name, key], **options_of(kernel))
    # The index of a colour is found by comparing alone.
    assert bool(re.search(r"\bfmul\b", text)) == (key != "index_image")
    assert not LOOSE.search(text) and not LIBRARY.search(text)


def sum_of_products(x, y, out):
    for i in range(len(x)):
        out[i] = x[i] * y[i] + np.sin(out[i])


def test_loose_code_would_be_seen():
    """Without this the patterns above might fit nothing."""
    signature = f"{LINE}, {LINE}, {LINE}"
    assert not LOOSE.search(code(sum_of_products, signature)) and LIBRARY.search(
        code(sum_of_products, signature)
    )
    for flags in ({"contract"}, {"reassoc", "nsz"}, True):
        assert LOOSE.search(code(sum_of_products, signature, fastmath=flags))


@pytest.mark.parametrize(("name", "key"), FREE)
def test_machine_code_for_arm_fuses_nothing(name, key):
    kernel = kernels(name)[key]
    text = for_arm(code(kernel.function, SIGNATURES[name, key], _nrt=False, **options_of(kernel)))
    assert re.search(r"\bfmul\b", text) and not FUSED.search(text)
    loose = code(kernel.function, SIGNATURES[name, key], _nrt=False, fastmath={"contract"})
    assert FUSED.search(for_arm(loose))
