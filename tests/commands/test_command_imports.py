"""What a command imports before it answers: packages that are slow to import come with the work that needs them."""

import subprocess
import sys

import pytest

SLOW = ("numpy", "scipy", "numba", "matplotlib", "torch", "jsonschema", "pymeshlab", "trimesh", "snakemake")
PLANNING = (
    "from lowalt.config.layers import overlaid; from lowalt.workflow.run import Run; import lowalt.workflow.options\n"
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


@pytest.mark.parametrize(("words", "packages"), [
    (["--help"], set()),
    (["run", "--help"], {"jsonschema", "numpy"}),
    (["predict", "default-seen", "missing.png"], {"numpy", "jsonschema"}),
])  # fmt: skip
def test_a_command_imports_what_its_answer_needs(words, packages):
    assert imported(f"from lowalt.__main__ import main; main({words})") <= packages


def test_planning_a_run_imports_no_compiler_and_no_network():
    assert not imported(PLANNING) & {"numba", "torch", "pymeshlab", "snakemake"}


def test_a_package_that_is_imported_is_seen():
    assert imported("import numpy; raise SystemExit(2)") == {"numpy"}


COMPILER = "torch._dynamo"
"""torch's compiler, which takes longer to import than the rest of torch."""


@pytest.mark.parametrize(("program", "compiler"), [
    pytest.param("import timm", True, marks=pytest.mark.slow),
    ("from lowalt.recognition.light_timm import timm; timm.create_model('test_resnet', num_classes=0)", False),
    ("from lowalt.recognition.zoo import opened; opened('default-seen')", False),
])  # fmt: skip
def test_a_network_is_built_without_the_compiler_of_torch(program, compiler):
    """The first program shows that timm alone still imports it."""
    text = f"import sys\n{program}\nprint({COMPILER!r} in sys.modules)"
    run = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    assert run.stdout.splitlines()[-1] == str(compiler)


def test_what_needs_the_compiler_still_finds_it():
    text = (
        "from lowalt.recognition.light_timm import timm\nimport torch\nfrom torchvision.ops import roi_align\n"
        "print(roi_align(torch.ones(1, 1, 8, 8), [torch.tensor([[0.0, 0, 4, 4]])], 2).tolist())\n"
        "print(torch.compile(torch.nn.Identity()) is not None)"
    )
    run = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    assert run.stdout.splitlines() == [str([[[[1.0, 1.0], [1.0, 1.0]]]]), "True"]
