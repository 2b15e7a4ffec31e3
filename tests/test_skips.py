"""Skips are counted: a reason that the machine gives passes, a missing package fails a strict run."""

import subprocess
import sys
from pathlib import Path

import pytest

SUPPORT = Path(__file__).parent / "support"
CASES = {
    "the machine's": ("import pytest\n\ndef test_it():\n    pytest.skip('no bash')\n", 0, "skipped: 1 x no bash"),
    "a package's": (
        "import pytest\n\ndef test_it():\n    pytest.importorskip('no_such_package')\n", 1,
        "UNEXPECTED SKIP: 1 x could not import 'no_such_package'",
    ),
    "a file's": ("import pytest\npytest.importorskip('none_such')\n\ndef test_it():\n    pass\n", 1,
                 "UNEXPECTED SKIP: 1 x could not import 'none_such'"),
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "workers"), [*((name, ()) for name in CASES), ("a package's", ("-n", "2")), ("a file's", ("-n", "2"))]
)
def test_a_strict_run_fails_where_a_test_is_skipped_for_a_reason_not_listed(tmp_path, name, workers):
    source, status, words = CASES[name]
    (tmp_path / "test_one.py").write_text(source)
    (tmp_path / "test_two.py").write_text("def test_other():\n    pass\n")
    hooks = (
        "import sys\nsys.path.insert(0, {!r})\nfrom skips import Skips\n\n"
        "def pytest_addoption(parser):\n    parser.addoption('--strict-skips', action='store_true')\n\n"
        "def pytest_configure(config):\n"
        "    if not hasattr(config, 'workerinput'):\n        config.pluginmanager.register(Skips())\n"
    )
    (tmp_path / "conftest.py").write_text(hooks.format(str(SUPPORT)))
    command = [sys.executable, "-m", "pytest", "-q", "--strict-skips", "-p", "no:cacheprovider", *workers]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == status, run.stdout
    assert words in run.stdout
