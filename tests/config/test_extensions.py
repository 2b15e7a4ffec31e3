"""Extensions: how they are found, what a faulty one does, and where the border between them and the core is."""

import os
import shutil
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from lowalt.config import extensions
from lowalt.config.core_commands import Command
from lowalt.config.extensions import AddedEffect, Extension, found
from lowalt.files.package_plan import PACKAGE, ROOMS, modules, rooms_imported

ROOT = Path(__file__).parents[2]
GOOD = Extension(commands={"hum": Command("hum.command", "hums", "lowalt hum")})
TAKEN = Extension(commands={"run": Command("hum.command", "runs", "lowalt run")})
NO_COMMAND = Extension(commands={"hum": "hum.command"})
AGAIN = Extension(effects={"mist": AddedEffect("other", "channel")}, commands=GOOD.commands)
NUMBER = 3


@pytest.fixture
def installed(monkeypatch):
    """A function that makes these names of this module the only extensions, and returns what is found."""

    def only(*names: str) -> extensions.Found:
        """What is found."""
        points = [EntryPoint(name.lower(), f"{__name__}:{name}", extensions.GROUP) for name in names]
        monkeypatch.setitem(sys.modules, __name__, sys.modules[__name__])
        monkeypatch.setattr(extensions, "entry_points", lambda group: points)
        found.cache_clear()
        return found()

    yield only
    found.cache_clear()


@pytest.mark.parametrize(("name", "says"), [
    ("MISSING", "has no attribute"), ("NUMBER", "expected an Extension"), ("NO_COMMAND", "expected a Command"),
    ("TAKEN", "lowalt's own"),
])  # fmt: skip
def test_a_faulty_extension_is_one_sentence_and_the_others_stay(installed, name, says):
    seen = installed("GOOD", name)
    assert list(seen.extensions) == ["good"]
    assert len(seen.faults) == 1
    assert f"extension {name.lower()!r} of the package" in seen.faults[0]
    assert says in seen.faults[0]
    assert seen.faults[0] in extensions.extensions_in_words()


def test_of_two_extensions_with_one_name_the_second_is_left_out(installed):
    seen = installed("GOOD", "AGAIN")
    assert len(seen.extensions) == 1
    assert "commands 'hum'" in seen.faults[0]


@pytest.mark.parametrize("room", ROOMS)
def test_no_room_of_the_core_imports_an_extension(room):
    """Imports inside functions count as well."""
    extended = {path.name: [name for name in rooms_imported(path) if "/" in name] for path in modules(room)}
    assert not {name: wrong for name, wrong in extended.items() if wrong}


def test_the_face_of_the_package_imports_no_extension():
    assert not [name for path in PACKAGE.glob("*.py") for name in rooms_imported(path) if "/" in name]


def test_a_run_that_names_no_extension_imports_none():
    program = (
        "import sys; from lowalt.config.layers import overlaid; from lowalt.workflow.run import Run; import lowalt\n"
        "config = overlaid([]); Run.of(config, 'workflow/schemas/config.schema.yaml', None)\n"
        "config['targets']['select'] = ['Crow']; next(iter(lowalt.Dataset(config)))\n"
        "print([name for name in sys.modules if name.startswith('lowalt.extensions.')])"
    )
    run = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
    assert run.stdout.splitlines()[-1] == "[]"


def without_extensions(folder: Path) -> dict[str, str]:
    """A copy of the tree without extensions and their tests; returns the environment in which it is lowalt."""
    left_out = shutil.ignore_patterns("extensions", "__pycache__", "*.egg-info")
    for name in ("src", "tests", "config", "workflow"):
        shutil.copytree(ROOT / name, folder / name, ignore=left_out)
    for name in ("Snakefile", "pyproject.toml", "studies", "docs", "results", "benchmarks", "profiles", "examples"):
        (folder / name).symlink_to(ROOT / name)
    # Python takes the first package of a name on its path, so that this one hides the installed entry points.
    package = folder / "src/lowalt-1.0.0.dist-info"
    package.mkdir()
    (package / "METADATA").write_text("Metadata-Version: 2.1\nName: lowalt\nVersion: 1.0.0\n")
    return {**os.environ, "PYTHONPATH": str(folder / "src")}


def test_the_core_without_the_folder_of_extensions_works(tmp_path):
    environment = without_extensions(tmp_path)
    cheap = ["tests/files", "tests/noise", "tests/config/test_config.py", "tests/scene/test_contract.py"]
    words = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *cheap]
    run = subprocess.run(words, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert not run.returncode, run.stdout[-3000:]
    words = [sys.executable, "-m", "lowalt", "--help"]
    shown = subprocess.run(words, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
    assert "lowalt run" in shown.stdout and "extensions:" not in shown.stdout


def test_a_strangers_package_adds_an_effect_a_spectrum_and_a_command(tmp_path):
    """The example, installed with pip into a folder of its own."""
    shutil.copytree(ROOT / "examples/extension", tmp_path / "package")
    words = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    words += ["--target", str(tmp_path / "installed"), str(tmp_path / "package")]
    subprocess.run(words, check=True, capture_output=True)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path / "installed"), str(ROOT / "src")])}

    def lowalt(*words: str) -> str:
        """What `lowalt` prints."""
        words = (sys.executable, "-m", "lowalt", *words)
        return subprocess.run(words, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True).stdout

    assert "mist (package lowalt-mist): commands mist; effects mist; spectra power" in lowalt("--help")
    # 0.4 dB/km over 500 m are 0.2 dB.
    assert f"{10 ** (-0.2 / 20):.4f}" in lowalt("mist", "500")
    (tmp_path / "misty.yaml").write_text(
        "run: misty\neffects: {mist: {db_per_km: 2}}\nspectra: {power: {window: 64, hop: 1, points: 256}}\n"
    )
    assert "power" in lowalt("spectra", "misty.yaml")
    assert "mist" in lowalt("explain", "misty.yaml", "--sample", "DJI Mini 2:0")
