"""What a command imports before it answers: packages that are slow to import come with the work
that needs them.
"""

import subprocess
import sys

import pytest

SLOW = (
    "numpy",
    "scipy",
    "numba",
    "matplotlib",
    "torch",
    "jsonschema",
    "pymeshlab",
    "trimesh",
    "snakemake",
)
PLANNING = (
    "from lowalt.config.layers import overlaid; from lowalt.workflow.run import Run; import "
    "lowalt.workflow.stages.tiles\n"
    "Run.of(overlaid([]), 'workflow/schemas/config.schema.yaml', None)"
)


def imported(program: str) -> set[str]:
    """The packages of SLOW that a program has imported when it ends, whatever its exit status."""
    text = (
        f"import sys\ntry:\n    exec({program!r})\nexcept SystemExit:\n    pass\n"
        f"print(*(name for name in {SLOW} if name in sys.modules))"
    )
    run = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    return set(run.stdout.splitlines()[-1].split())


@pytest.mark.parametrize(
    ("words", "packages"),
    [
        (["--help"], set()),
        (["run", "--help"], {"jsonschema", "numpy"}),
        (
            ["predict", "results/zoo/default-seen.safetensors", "missing.png"],
            {"numpy", "jsonschema"},
        ),
    ],
)
def test_a_command_imports_what_its_answer_needs(words, packages):
    assert imported(f"from lowalt.__main__ import main; main({words})") <= packages


def test_planning_a_run_imports_no_compiler_and_no_network():
    assert not imported(PLANNING) & {"numba", "torch", "pymeshlab", "snakemake"}


def test_a_package_that_is_imported_is_seen():
    assert imported("import numpy; raise SystemExit(2)") == {"numpy"}
