"""Kept machine code follows what it is compiled from, and no more.

That is kernels, constants and settings, however deep.
"""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import lowalt
from forks import printed
from lowalt.echo.fast.driver import run
from lowalt.echo.pointwise.results import matrix
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.machine.jit import INNER, LEAN, digest
from lowalt.machine.machine_code import _DigestCache, dispatcher

PROGRAM = """
import sys
from pathlib import Path

package, name, text, other = {!r}
path = Path(package) / name
kept = path.read_text()
assert text in kept
path.write_text(kept.replace(text, other))
# Bytecode is not kept: two edits of equal length within a second would look alike.
sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(package).parent))
from lowalt.machine.jit import digest
from lowalt.echo.fast.driver import run
from lowalt.echo.pointwise.results import matrix
path.write_text(kept)
print(digest(run.function), digest(matrix.function))
"""
"""Edits a source file of a copy of the package and prints the digests of two of the echo's kernels.
"""

EDITS = load_yaml("tests/data/tables/source_edits.yaml")
"""Edits of sources: a file, a text, its replacement, and whether the keys of both kernels change."""


@pytest.fixture(scope="module")
def digests(tmp_path_factory):
    """The two digests after each edit."""
    place = tmp_path_factory.mktemp("sources") / "lowalt"
    shutil.copytree(
        Path(lowalt.__file__).parent, place, ignore=shutil.ignore_patterns("__pycache__")
    )
    programs = [
        PROGRAM.format((str(place), edit["file"], edit["text"], edit["replacement"]))
        for edit in EDITS.values()
    ]
    return dict(zip(EDITS, map(str.split, printed(programs)), strict=True))


@pytest.mark.parametrize("case", EDITS)
def test_the_key_changes_with_what_is_compiled_alone(case, digests):
    before = digests["nothing"]
    assert [int(new != old) for new, old in zip(digests[case], before, strict=True)] == EDITS[case][
        "changes"
    ]


def test_kernels_of_the_echo_are_kept_by_that_key():
    class Codegen:
        def magic_tuple(self):
            return ("processor",)

    # numba offers no public name for the key of a cache entry; only the key shows that this cache
    # is asked.
    for compiled in (run, matrix):
        cache = compiled.dispatcher._cache
        assert isinstance(cache, _DigestCache)
        assert digest(compiled.function, compiled.options) in cache._index_key(
            ("signature",), Codegen()
        )


def test_a_kernel_without_an_entry_for_python_refuses_a_call_and_serves_kernels():
    """Without the refusal numba would jump to address 0, which ends the process."""
    inner = INNER(times_three)
    outer = LEAN(lambda x: inner(x) + 1.0)
    assert outer(2.0) == 7.0
    with pytest.raises(TypeError, match="times_three has no entry for Python"):
        inner(2.0)
    # Kept code without the entry is not taken for code with one.
    assert LEAN(times_three)(2.0) == 6.0


def times_three(x):
    return 3.0 * x


def test_kept_code_for_a_type_that_has_moved_is_compiled_anew(tmp_path):
    pair = "from typing import NamedTuple\nclass Pair(NamedTuple):\n    a: float\n    b: float\n"
    (tmp_path / "one.py").write_text(pair)
    (tmp_path / "use.py").write_text(
        "from lowalt.machine.jit import LEAN\n@LEAN\ndef total(pair):\n    return pair.a + pair.b\n"
    )
    program = (
        "import sys, use; print(use.total(getattr(__import__(sys.argv[1]), 'Pair')(1.0, 2.0)))"
    )
    paths = f"{tmp_path}:{Path(lowalt.__file__).parents[1]}"
    for module in ("one", "two"):
        call = [sys.executable, "-c", program, module]
        done = subprocess.run(
            call, env={"PYTHONPATH": paths}, capture_output=True, text=True, check=True
        )
        assert done.stdout == "3.0\n"
        (tmp_path / f"{module}.py").rename(tmp_path / "two.py")


PRODUCTS = """
import numpy as np
from lowalt.machine.jit import LEAN, VECTOR


def loop(a, b, out):
    for k in range(len(out)):
        out[k] = a[k] * b[k]


def other(a, b, out):
    for k in range(len(out)):
        out[k] = a[k] * b[k]


rng = np.random.default_rng(1)
a, b = rng.normal(size=(2, 300, 2)).view(complex)[..., 0]
found = np.empty(300, complex)
VECTOR(other)(a, b, found.copy())
LEAN(loop)(a, b, found)
written = (a.real * b.real - a.imag * b.imag) + 1j * (a.real * b.imag + a.imag * b.real)
print((found == written).all())
"""


SHARED = """
import platform
import numpy as np
from numba import njit
from numba.core.registry import cpu_target


def loop(a, b, out):
    for k in range(len(out)):
        out[k] = a[k] * b[k]


def other(a, b, out):
    for k in range(len(out)):
        out[k] = a[k] * b[k]


rng = np.random.default_rng(1)
a, b = rng.normal(size=(2, 300, 2)).view(complex)[..., 0]
found = np.empty(300, complex)
njit(fastmath={"contract"})(other)(a, b, found.copy())
njit(loop)(a, b, found)
written = (a.real * b.real - a.imag * b.imag) + 1j * (a.real * b.imag + a.imag * b.real)
fuses = platform.machine() != "x86_64" or "+fma" in cpu_target.target_context.codegen().magic_tuple()[2]
print((found == written).all() != fuses)
"""


CALLED = """
import platform
import numpy as np
from numba.core.registry import cpu_target
from lowalt.machine.jit import INNER, LEAN, PLAIN, VECTOR
from lowalt.machine.machine_code import _DigestCache

_DigestCache.load_overload = lambda *_arguments: None


def callee(a, b):
    return a.real * b.real - a.imag * b.imag


def calling(called):
    def loop(a, b, out):
        for k in range(len(out)):
            out[k] = called(a[k], b[k])

    return VECTOR(loop)


rng = np.random.default_rng(1)
a, b = rng.normal(size=(2, 300, 2)).view(complex)[..., 0]
found = np.empty(300)
fuses = platform.machine() != "x86_64" or "+fma" in cpu_target.target_context.codegen().magic_tuple()[2]
for kind in (INNER, LEAN, PLAIN, VECTOR):
    calling(kind(callee))(a, b, found)
    as_written = (found == a.real * b.real - a.imag * b.imag).all()
    print(as_written == (kind is not VECTOR or not fuses))
"""


@pytest.mark.parametrize(("program", "kinds"), [(PRODUCTS, 1), (SHARED, 1), (CALLED, 4)])
def test_products_are_fused_in_no_kernel_that_is_done_as_written(program, kinds, tmp_path):
    """numba compiles such a product once for all kernels, with the options of the first one, and
    takes an option that a function does not give from the function that calls it first. Its own
    kernels, and the last kind of those that are called, are controls: they are fused where the
    processor has such instructions.
    """
    (tmp_path / "products.py").write_text(program)
    ended = subprocess.run(
        [sys.executable, "products.py"], cwd=tmp_path, capture_output=True, text=True
    )
    assert ended.stdout == "True\n" * kinds, ended.stderr


def test_the_key_of_kept_code_has_the_kernel_s_own_options():
    assert (
        len(
            {
                digest(run.function, options)
                for options in (None, {"fastmath": {"contract"}}, {"fastmath": set()})
            }
        )
        == 3
    )


LINKED = """
from lowalt.machine.jit import LEAN


@LEAN
def called(x):
    {}
    return x


@LEAN
def caller(x):
    return called(x)
"""
"""A function that is too long to be copied into its caller."""


def test_a_kept_kernel_calls_the_function_that_it_was_compiled_with(tmp_path):
    # As numba links, the function that was loaded first also serves a second caller, whose answer
    # then is 2.0. In the same way the bits of a scene depended on whether its kernels had been
    # compiled in the process.
    uses = []
    for offset in ("1.0", "2.0"):
        module = tmp_path / offset / "linked.py"
        module.parent.mkdir()
        module.write_text(LINKED.format(60 * f"x = x * 0.5 + {offset}; "))
        uses.append(
            f"sys.path.insert(0, {str(module.parent)!r}); sys.modules.pop('linked', None); import"
            " linked"
        )
    # The first two programs compile, the third finds machine code in the cache.
    programs = [["import sys", use, "print(linked.caller(0.0))"] for use in uses]
    programs += [
        ["import sys", uses[0], "print(linked.called(0.0))", uses[1], "print(linked.caller(0.0))"]
    ]
    assert printed(["\n".join(lines) for lines in programs]) == ["2.0\n", "4.0\n", "2.0\n4.0\n"]


def test_machine_code_that_no_folder_can_keep_is_refused_with_the_variable_that_names_one(
    monkeypatch,
):
    monkeypatch.setenv("XDG_CACHE_HOME", "/proc/nowhere")
    names: dict = {}
    exec(compile("def twice(x):\n    return 2 * x\n", "/proc/nowhere/kernel.py", "exec"), names)
    with pytest.raises(
        InputError, match=r"beside /proc/nowhere/kernel.py nor .* expected XDG_CACHE_HOME: a folder"
    ):
        dispatcher(names["twice"], {}, str)
