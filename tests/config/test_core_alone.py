"""The core without the folder of extensions: its tests pass, and it makes the default's data."""

import os
import shutil
import subprocess
import sys
from importlib.metadata import distribution
from pathlib import Path

import pytest

from lowalt.files.package_plan import ROOMS
from lowalt.shards import manifest

ROOT = Path(__file__).parents[2]
COPIED = ("src", "tests", "config", "workflow")
LINKED = (
    "Makefile",
    "benchmarks",
    "docs",
    "envs",
    "examples",
    "profiles",
    "pyproject.toml",
    "studies",
)
KEPT_RESULTS = ("benchmarks", "reference", "zoo")
OF_THE_WHOLE = (
    "attacks",
    "attacks_found",
    "brought",
    "bytes",
    "bytes_scenes",
    "bytes_effects",
    "bytes_fused",
    "laws",
    "physics",
    "portable_rooms",
    "waveforms",
)
"""Tests of the core that belong to no single room. The others beside them are of documents,
studies and releases, which name extensions too.
"""
CORE_TESTS = [
    *(f"tests/{room}" for room in ROOMS),
    *(f"tests/test_{name}.py" for name in OF_THE_WHOLE),
]
CHEAP = "tests/files/test_csv_tables.py"


@pytest.fixture(scope="module")
def core(tmp_path_factory):
    """A function that runs Python in a copy of the tree without extensions and their tests; its
    attribute `folder` is that of the copy.
    """
    folder = tmp_path_factory.mktemp("core")
    left_out = shutil.ignore_patterns("extensions", "*.egg-info")
    for name in COPIED:
        shutil.copytree(ROOT / name, folder / name, ignore=left_out)
    shutil.copy(ROOT / "Snakefile", folder)
    for name in LINKED:
        (folder / name).symlink_to(ROOT / name)
    (folder / "results").mkdir()
    for name in KEPT_RESULTS:
        (folder / "results" / name).symlink_to(ROOT / "results" / name)
    # Python takes the first package of a name on its path, so that this one, without entry points,
    # hides the installed one.
    installed = distribution("lowalt")
    package = folder / f"src/lowalt-{installed.version}.dist-info"
    package.mkdir()
    (package / "METADATA").write_text(installed.read_text("METADATA"))
    environment = {**os.environ, "PYTHONPATH": str(folder / "src")}

    def run(*words: str) -> str:
        """What Python prints with these words; fails where its exit status is not 0."""
        line = [sys.executable, *words]
        ran = subprocess.run(line, cwd=folder, env=environment, capture_output=True, text=True)
        assert not ran.returncode, ran.stdout[-5000:] + ran.stderr[-5000:]
        return ran.stdout

    assert (
        not list(folder.rglob("src/**/extensions")) and not (folder / "tests/extensions").exists()
    )
    run.folder = folder
    return run


def test_the_tests_of_the_core_are_set_up_without_extensions(core):
    assert " passed" in core("-m", "pytest", "-p", "no:cacheprovider", CHEAP)


def test_the_command_line_lists_the_commands_of_the_core(core):
    shown = core("-m", "lowalt", "--help")
    assert "lowalt run" in shown
    assert "extensions:" not in shown and "left out" not in shown


def test_the_jobs_of_a_run_are_planned(core):
    core("-m", "lowalt", "run", "-n", "--configfile", "config/tiny.yaml", "--target", "data")


# All tests of the core in one process: some twenty minutes.
@pytest.mark.slow
def test_all_tests_of_the_core_pass(core):
    without_these = ("--ignore", f"tests/config/{Path(__file__).name}")
    core(
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "-m",
        "not slow",
        *without_these,
        *CORE_TESTS,
    )


@pytest.mark.slow
def test_the_default_s_data_are_byte_equal(core):
    core("-m", "lowalt", "run", "--target", "data")
    reference = ROOT / "results/reference/default.sha256"
    assert manifest.faults(reference, core.folder / "results/default") == []
