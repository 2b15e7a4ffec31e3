"""The layout of the package: imports go one way, entry points stay light, and no stray file is in
the repository.
"""

import ast
import functools
import io
import subprocess
import tokenize
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import rooms_picture
from PIL import Image
from scipy import ndimage

from forks import printed
from lowalt.files.package_plan import EXTENSIONS, PACKAGE, ROOMS, modules, rooms_imported
from lowalt.scene.effects import PLACES

ROOT = Path(__file__).parent.parent
GROUND = ("files", "machine", "numerics", "config")
STAGES = [name for name in ROOMS if name not in (*GROUND, "measure", "workflow", "commands")]


@pytest.mark.parametrize("stage", ROOMS)
def test_a_stage_imports_only_what_stands_before_it(stage):
    allowed = set(ROOMS[: ROOMS.index(stage) + 1])
    files = modules(stage)
    assert files
    assert not {path.name: wrong for path in files if (wrong := rooms_imported(path) - allowed)}


LIGHT = [stage for stage in STAGES if stage not in ("spectra", "recognition")]
EARLY = (
    "targets.gallery",
    "shards.card",
    "recognition",
    "recognition.views",
    "recognition.freeze",
    "recognition.distances",
    "recognition.sample_sources",
    "recognition.evaluated",
    "recognition.tables",
    "recognition.score",
    "recognition.augment",
    "measure.echo_cost",
    "report.figures.cost_plots",
    "config.layers",
    "workflow.run",
)
"""What runs before the first training, while `make` may still be fetching torch, and tables."""
SCENES = [{}, *({name: {}} for name in PLACES)]
PROGRAMS = {
    **{
        stage: f"import sys, lowalt.{stage}.__main__; print('torch' in sys.modules)"
        for stage in LIGHT
    },
    "plain": (
        "import sys, lowalt.echo.__main__, lowalt.noise.__main__; print('lowalt.scene' in"
        " sys.modules)"
    ),
    "early": (
        "import importlib, sys\n"
        f"for name in {EARLY!r}:\n"
        "    importlib.import_module('lowalt.' + name)\n"
        "print('torch' in sys.modules)"
    ),
    "no cubes": "import sys, lowalt.shards.__main__; print('lowalt.tiles.cubes' in sys.modules)",
    "scenes": (
        "import os, sys, lowalt.echo.__main__, lowalt.scene.__main__, lowalt.noise.__main__\n"
        "from lowalt.scene.effects import called\n"
        f"for scene in {SCENES!r}:\n"
        "    if os.fork() == 0:\n"
        "        called(scene)\n"
        "        break\n"
        "    os.wait()\n"
        "else:\n"
        "    sys.exit()\n"
        "folders = ('lowalt.scene.effects.', 'lowalt.extensions.')\n"
        "names = [n for n in sys.modules if n.startswith(folders) and n.count('.') > 2]\n"
        "print(*(n.rpartition('.')[2] for n in names), flush=True)\n"
        "os._exit(0)"
    ),
}


@pytest.fixture(scope="module")
def said() -> dict[str, str]:
    """What each of the programs prints, each in a process of its own."""
    return dict(zip(PROGRAMS, printed([*PROGRAMS.values()]), strict=True))


def test_data_and_what_comes_before_the_first_training_never_import_torch(said):
    programs = [*LIGHT, "early"]
    assert {name: said[name] for name in programs} == dict.fromkeys(programs, "False\n")


def test_what_no_scene_names_is_not_imported(said):
    found = [
        {other for other in line.split() if other in PLACES}
        for line in said["scenes"].split("\n")[:-1]
    ]
    assert found == [set(scene) for scene in SCENES]


def test_a_run_without_effects_and_shards_without_cubes_import_nothing_of_them(said):
    assert said["plain"] == said["no cubes"] == "False\n"


def test_the_plan_of_the_package_names_every_room():
    assert {path.parent.name for path in PACKAGE.glob("*/__init__.py")} - {"extensions"} == set(
        ROOMS
    )


def test_the_picture_of_the_house_has_a_mark_for_every_import_between_rooms():
    pairs = set(zip(*rooms_picture.imports(), strict=True))
    assert ("measure", "recognition") in pairs
    assert not {(room, other) for room, other in pairs if room == "files"}
    picture = np.asarray(Image.open(io.BytesIO(rooms_picture.draw())).convert("RGB")).astype(int)
    # Dots are the only thing in colour. The first column of dots is that of the room `files`.
    dots, count = ndimage.label(picture[..., 2] - picture[..., 0] > 40)
    centres = np.array(ndimage.center_of_mass(dots > 0, dots, range(1, count + 1)))
    # The first room imports none, and none imports the last.
    places = (centres - centres.min(axis=0)) / np.ptp(centres, axis=0) * (len(ROOMS) - 2)
    found = [
        (ROOMS[row + 1], ROOMS[column]) for row, column in np.rint(places).astype(int).tolist()
    ]
    assert sorted(found) == sorted(pairs)


class File:
    """What the tests below ask of a Python file: its docstring, its classes, and its functions with
    their lines.
    """

    def __init__(self, path: Path) -> None:
        """Read the file."""
        tree = ast.parse(path.read_text())
        self.docstring = ast.get_docstring(tree)
        self.classes = [node.name for node in tree.body if isinstance(node, ast.ClassDef)]
        # Those inside classes and other functions as well.
        self.functions = [
            (node.name, node.end_lineno - node.lineno, ast.get_docstring(node))
            for node in ast.walk(tree)
            if isinstance(node, ast.FunctionDef)
        ]


# Reading all files takes a second.
file = functools.cache(File)


def test_every_module_says_what_it_holds():
    assert not [path for path in PACKAGE.rglob("*.py") if not file(path).docstring]


def python_files(*folders: str) -> list[Path]:
    """The Python files below these folders of the repository."""
    return [path for folder in folders for path in sorted((ROOT / folder).rglob("*.py"))]


def test_every_function_says_what_it_does():
    bare = [
        f"{path.name}: {name}"
        for path in python_files("src", "benchmarks", "tests/support")
        for name, _, docstring in file(path).functions
        if not name.startswith("__") and not docstring
    ]
    assert not bare


def test_functions_have_at_most_90_lines_and_files_600():
    files = python_files("src", "benchmarks", "tests", "docs", "examples")
    lines = {path.relative_to(ROOT): len(path.read_text().splitlines()) for path in files}
    long = [
        f"{path.name}: {name}"
        for path in files
        for name, more_lines, _ in file(path).functions
        if more_lines >= 90
    ]
    assert not long
    assert not {str(path): count for path, count in lines.items() if count > 600}


def test_no_name_of_a_class_stands_for_two_things():
    defined = Counter(name for path in python_files("src/lowalt") for name in file(path).classes)
    assert not {name for name, count in defined.items() if count > 1}


def test_no_base_name_of_a_module_stands_for_two_modules():
    # The modules of `workflow/stages` have the names of their rule files.
    names = Counter(
        path.name
        for path in python_files("src/lowalt")
        if not path.name.startswith("__") and path.parent.name != "stages"
    )
    assert not {name for name, count in names.items() if count > 1}


def test_no_tracked_file_is_large_or_names_this_machine():
    tracked = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True)
    if tracked.returncode:
        pytest.skip("not a git checkout")
    files = [ROOT / name for name in tracked.stdout.split("\0") if name]
    files = [path for path in files if path.is_file()]
    assert files
    assert not [path for path in files if path.stat().st_size > 1_000_000]
    home = "/" + "work/"
    named = [
        path for path in files if path.suffix != ".png" and home in path.read_text(errors="replace")
    ]
    assert not named


SKIPPED = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENCODING,
    tokenize.ENDMARKER,
}


def tokens(text: str) -> int:
    """The number of tokens of a Python source, without comments, documentation and line ends."""
    documented = {
        line
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
        for line in range(node.lineno, node.end_lineno + 1)
    }
    found = tokenize.generate_tokens(io.StringIO(text).readline)
    return sum(token.type not in SKIPPED and token.start[0] not in documented for token in found)


TOKENS = {
    "files": 5_342,
    "machine": 3_563,
    "numerics": 9630,
    "config": 7_902,
    "targets": 45724,
    "motion": 9026,
    "echo": 19774,
    "scene": 52037,
    "noise": 1221,
    "spectra": 5357,
    "tiles": 10754,
    "shards": 25012,
    "recognition": 33021,
    "measure": 5423,
    "report": 17_630,
    "workflow": 11455,
    "commands": 6429,
    "extensions/benchmark": 12325,
    "extensions/drafting": 27658,
    "extensions/formats": 2_307,
    "extensions/recordings": 33_201,
    "extensions/town": 22928,
}
"""Tokens of each room and extension. A commit that needs more than SLACK above it raises its figure
and says why.
"""
SLACK = 1.05


def sizes() -> dict[str, int]:
    """Tokens of each room of the core and of each extension."""
    return {
        room: sum(tokens(path.read_text()) for path in modules(room))
        for room in (*ROOMS, *EXTENSIONS)
    }


def test_tokens_count_neither_documentation_nor_line_ends():
    packed = "a, b = f(x), 2\n"
    assert tokens(packed) == 10
    assert (
        tokens('"""What it\nholds."""\n\n# Why.\na, b = (\n    f(x),\n    2\n)\n')
        == tokens(packed) + 2
    )


def test_no_room_and_no_extension_grows_by_more_than_the_slack():
    found = sizes()
    assert set(ROOMS) <= set(found) <= set(TOKENS)
    assert not {room: count for room, count in found.items() if count > SLACK * TOKENS[room]}
