"""Skips are counted: a reason that the machine gives passes, a missing package fails a strict run."""

import subprocess
import sys
from pathlib import Path

import pytest

SUPPORT = Path(__file__).parent / "support"
MACHINE = "import pytest\n\ndef test_it():\n    pytest.skip('no bash')\n"
PACKAGE = "import pytest\n\ndef test_it():\n    pytest.importorskip('no_such_package')\n"
FILE = "import pytest\npytest.importorskip('none_such')\n\ndef test_it():\n    pass\n"
UNEXPECTED = [
    f"UNEXPECTED SKIP: 1 x could not import '{name}'" for name in ("no_such_package", "none_such")
]
HOOKS = """
import sys
sys.path.insert(0, {!r})
from skips import Skips

def pytest_addoption(parser):
    parser.addoption("--strict-skips", action="store_true")

def pytest_configure(config):
    if not hasattr(config, "workerinput"):
        config.pluginmanager.register(Skips())
"""


@pytest.mark.parametrize(
    ("sources", "workers", "status", "words"),
    [
        ([MACHINE], [], 0, ["skipped: 1 x no bash"]),
        ([PACKAGE, FILE], [], 1, UNEXPECTED),
        ([PACKAGE, FILE], ["-n", "2"], 1, UNEXPECTED),
    ],
)
def test_a_strict_run_fails_where_a_test_is_skipped_for_a_reason_not_listed(
    tmp_path, sources, workers, status, words
):
    for number, source in enumerate(["def test_other():\n    pass\n", *sources]):
        (tmp_path / f"test_{number}.py").write_text(source)
    (tmp_path / "conftest.py").write_text(HOOKS.format(str(SUPPORT)))
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "--strict-skips",
        "-p",
        "no:cacheprovider",
        *workers,
    ]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == status, run.stdout
    assert all(line in run.stdout for line in words)
