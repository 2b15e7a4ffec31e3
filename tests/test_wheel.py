"""The source distribution and the wheel built from it carry the workflow: they make data anywhere,
with no checkout.
"""

import configparser
import hashlib
import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

from lowalt.files.shipped import SHIPPED, located, shipped

ROOT = Path(__file__).parents[1]
EXTENSIONS = ROOT / "src/lowalt/extensions"
BUILD = "from setuptools import build_meta; print(build_meta.build_{kind}({out!r}))"


def built(kind, tree, out):
    """Build an sdist or a wheel from a tree with the setuptools of this environment, and return its
    path.
    """
    run = subprocess.run(
        [sys.executable, "-c", BUILD.format(kind=kind, out=str(out))],
        cwd=tree,
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0, run.stderr
    return out / run.stdout.split()[-1]


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """A folder with what the wheel installs, built from the source distribution alone."""
    folder = tmp_path_factory.mktemp("wheel")
    tree = folder / "checkout"
    ignored = shutil.ignore_patterns("__pycache__", ".*", "*.egg-info", "results", "site")
    shutil.copytree(ROOT, tree, ignore=ignored)
    for name in ("reference", "zoo"):
        shutil.copytree(ROOT / "results" / name, tree / "results" / name)
    with tarfile.open(built("sdist", tree, folder)) as archive:
        archive.extractall(folder / "unpacked", filter="data")
    (unpacked,) = (folder / "unpacked").iterdir()
    shutil.rmtree(tree)
    with zipfile.ZipFile(built("wheel", unpacked, folder)) as archive:
        archive.extractall(folder / "site")
    return folder / "site"


def test_the_wheel_holds_the_workflow_and_says_that_it_is_typed(installed):
    package = installed / "lowalt"
    for name in (
        "Snakefile",
        "config",
        "workflow",
        "profiles",
        "envs",
        "results/reference",
        "results/zoo",
    ):
        files = [path for path in [ROOT / name, *(ROOT / name).rglob("*")] if path.is_file()]
        kept = {str(path.relative_to(ROOT)) for path in files if "__pycache__" not in path.parts}
        assert kept and all(
            (package / "shipped" / path).read_bytes() == (ROOT / path).read_bytes() for path in kept
        )
    assert (package / "py.typed").is_file()
    assert (installed / "snakemake_logger_plugin_lowalt/__init__.py").is_file()


def test_the_wheel_holds_the_extensions_with_their_files_and_entry_points(installed):
    files = [path for path in EXTENSIONS.rglob("*") if path.suffix in (".py", ".html")]
    assert {"town.py", "benchmark_results.html"} <= {path.name for path in files}
    for path in files:
        there = installed / "lowalt/extensions" / path.relative_to(EXTENSIONS)
        assert there.read_bytes() == path.read_bytes()
    (points,) = installed.glob("lowalt-*.dist-info/entry_points.txt")
    found = configparser.ConfigParser()
    found.read(points)
    names = {path.name for path in EXTENSIONS.iterdir() if (path / "__init__.py").is_file()}
    assert set(found["lowalt.extensions"]) == names


def said(command, folder):
    """What a program prints that sees no other variable of the environment than PATH and HOME; it
    must succeed.
    """
    environment = {"PATH": "/usr/bin:/bin", "HOME": str(folder)}
    run = subprocess.run(
        [*map(str, command)], cwd=folder, capture_output=True, text=True, env=environment
    )
    assert run.returncode == 0, run.stderr
    return run.stdout


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["*.whl", "*.tar.gz"])
def test_a_new_environment_has_the_command_and_makes_the_bytes_of_the_checkout(
    installed, tmp_path, kind
):
    """From the wheel, and from the source distribution, with the packages that they ask for and no
    others.
    """
    (package,) = installed.parent.glob(kind)
    python = tmp_path / "env/bin/python"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / "env"], check=True)
    # Without a refresh, uv takes a wheel that it built from an earlier source distribution of this
    # version.
    install = [
        Path(sys.executable).with_name("uv"),
        "pip",
        "install",
        "--quiet",
        "--refresh-package",
        "lowalt",
    ]
    subprocess.run(
        [*install, "--python", python, "-c", ROOT / "envs/constraints.txt", package], check=True
    )
    here = Path(sys.executable).with_name("lowalt")
    there = python.with_name("lowalt")
    assert said([there, "--help"], tmp_path) == said([here, "--help"], tmp_path)
    for program, folder in ((here, "here"), (there, "there")):
        said([program, "sample", "DJI Mini 2", "0", "--out", folder], tmp_path)
    made = {path.name: path.read_bytes() for path in (tmp_path / "there").iterdir()}
    assert made and made == {path.name: path.read_bytes() for path in (tmp_path / "here").iterdir()}


@pytest.mark.workflow
def test_the_installed_command_makes_the_reference_s_bytes_in_an_empty_folder(installed, tmp_path):
    environment = os.environ | {"PYTHONPATH": str(installed)}
    goal = "results/tiny/clouds/crow.npz"
    command = [
        sys.executable,
        "-m",
        "lowalt",
        "run",
        "--configfile",
        "config/tiny.yaml",
        "--target",
        goal,
    ]
    run = subprocess.run(
        [*command, "--cores", "1"], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stdout + run.stderr
    sums = dict(
        line.split()[::-1]
        for line in (ROOT / "results/reference/tiny.sha256").read_text().splitlines()
    )
    assert hashlib.sha256((tmp_path / goal).read_bytes()).hexdigest() == sums["clouds/crow.npz"]


def test_configurations_of_the_package_are_found_from_any_folder(installed, tmp_path):
    program = (
        "from lowalt.config.layers import overlaid;"
        " print(*overlaid(['config/scenes/urban.yaml'])['effects'])"
    )
    run = subprocess.run(
        [sys.executable, "-c", program],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(installed)},
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0 and "clutter" in run.stdout.split(), run.stderr


def test_a_file_of_the_working_directory_comes_before_the_package_s(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert shipped("config/targets.csv") == SHIPPED / "config/targets.csv"
    assert located({"targets": {"table": "config/targets.csv"}})["targets"]["table"] == str(
        SHIPPED / "config/targets.csv"
    )
    (tmp_path / "config").mkdir()
    (tmp_path / "config/targets.csv").write_text("own")
    assert shipped("config/targets.csv") == Path("config/targets.csv")
    assert (
        located({"targets": {"table": "config/targets.csv"}})["targets"]["table"]
        == "config/targets.csv"
    )
    for name in ("9" * 5000, "a\0b"):
        assert located({"targets": {"table": name}})["targets"]["table"] == name
    assert shipped("config/none.yaml") == Path("config/none.yaml")
