"""Extensions: how they are found, what a faulty one does, and where the border between them and the
core is.
"""

import re
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
FACE = Extension(functions={"receive": "hum.command"})
NO_COMMAND = Extension(commands={"hum": "hum.command"})
AGAIN = Extension(effects={"mist": AddedEffect("other", "channel")}, commands=GOOD.commands)
NUMBER = 3


def __getattr__(name: str) -> None:
    """End the process, or fail in two lines, where an entry point asks for it."""
    if name == "ENDS":
        sys.exit(7)
    if name == "LINES":
        raise RuntimeError("two\nlines")
    raise AttributeError(f"module has no attribute {name!r}")


@pytest.fixture
def installed(monkeypatch):
    """A function that makes these names of this module the only extensions, and returns what is
    found.
    """

    def only(*names: str) -> extensions.Installed:
        """What is found."""
        points = [
            EntryPoint(name.lower(), f"{__name__}:{name}", extensions.GROUP) for name in names
        ]
        monkeypatch.setitem(sys.modules, __name__, sys.modules[__name__])
        monkeypatch.setattr(extensions, "entry_points", lambda group: points)
        found.cache_clear()
        return found()

    yield only
    found.cache_clear()


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("MISSING", "has no attribute"),
        ("NUMBER", "expected an Extension"),
        ("ENDS", "SystemExit: 7"),
        ("LINES", "RuntimeError: two lines"),
        ("NO_COMMAND", "expected a Command"),
        ("TAKEN", "lowalt's own"),
        ("FACE", "functions 'receive' is lowalt's own"),
    ],
)
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
    extended = {
        path.name: [name for name in rooms_imported(path) if "/" in name] for path in modules(room)
    }
    assert not {name: wrong for name, wrong in extended.items() if wrong}


def test_no_test_of_the_core_names_a_module_of_an_extension():
    """Texts of programs that tests start count as well."""
    here = Path(__file__)
    assert not [
        str(path)
        for path in (ROOT / "tests").rglob("*.py")
        if "extensions" not in path.relative_to(ROOT / "tests").parts
        and path != here
        and re.search(r"lowalt\.extensions\.\w", path.read_text())
    ]


def test_the_face_of_the_package_imports_no_extension():
    assert not [
        name for path in PACKAGE.glob("*.py") for name in rooms_imported(path) if "/" in name
    ]


def test_a_run_that_names_no_extension_imports_none():
    program = (
        "import sys; from lowalt.config.layers import overlaid; from lowalt.workflow.run import "
        "Run; import lowalt\n"
        "config = overlaid([]); Run.of(config, 'workflow/schemas/config.schema.yaml', None)\n"
        "config['targets']['select'] = ['Crow']; next(iter(lowalt.Dataset(config)))\n"
        "print([name for name in sys.modules if name.startswith('lowalt.extensions.')])"
    )
    run = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert run.stdout.splitlines()[-1] == "[]"
