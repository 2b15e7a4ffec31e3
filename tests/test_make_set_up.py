"""Set-up says what it does before each step that takes time, and makes data during a download.

The programs that the Makefile starts are replaced by a shell script, which logs how it was called.
"""

import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PROGRAM = """#!/bin/sh
echo "$(basename "$0") $*" >>"$LOG"
echo "started $(basename "$0") $*" >&2
until_there() {
    tries=0
    until test -e "$1" || test $tries -eq 600; do sleep 0.1; tries=$((tries + 1)); done
    test -e "$1" || echo "$1 never came" >>"$LOG"
}
case "$(basename "$0") $*" in
    *"-m venv"*) mkdir -p .venv/bin
        for name in python uv lowalt snakemake; do cp "$0" ".venv/bin/$name"; done ;;
    *'"recognition"'*) echo torch ;;
    uv*torch*) test -z "$DOWNLOAD_UNTIL" || until_there "$DOWNLOAD_UNTIL" ;;
    lowalt*sample*) touch .venv/sampling
        test -n "$DOWNLOAD_UNTIL" || until_there "$COMPILE_UNTIL" ;;
    snakemake*prepared*) touch .venv/data-made ;;
esac
"""


def make(
    folder: Path,
    *targets: str,
    download_until: str = "",
    compile_until: str = ".venv/set-up-training",
) -> tuple[list[str], list[str]]:
    """What `make` and the programs that it starts print, and these programs, both line by line.

    download_until: the file that has to appear before the packages of training are there; without
    it, machine code takes longer than they do, until `compile_until` is there.
    """
    log = folder / "log"
    log.unlink(missing_ok=True)
    environment = {
        "PATH": "/usr/bin:/bin",
        "HOME": str(folder),
        "LOG": str(log),
        "DOWNLOAD_UNTIL": download_until,
        "COMPILE_UNTIL": compile_until,
    }
    run = subprocess.run(
        ["make", f"PYTHON={folder / 'python'}", *targets],
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=300,
    )
    assert run.returncode == 0, run.stdout
    started = log.read_text()
    assert "never came" not in started, started
    return run.stdout.splitlines(), started.splitlines()


@pytest.fixture
def checkout(tmp_path) -> Path:
    """A checkout that is not set up, and the script in place of Python."""
    (tmp_path / "envs").mkdir()
    (tmp_path / "envs/constraints.txt").touch()
    (tmp_path / "pyproject.toml").touch()
    shutil.copy(ROOT / "Makefile", tmp_path)
    python = tmp_path / "python"
    python.write_text(PROGRAM)
    python.chmod(0o755)
    return tmp_path


def at(lines: list[str], text: str) -> int:
    """The number of the first line that holds a text."""
    return next(number for number, line in enumerate(lines) if text in line)


def test_set_up_says_each_step_before_it_starts(checkout):
    said, _ = make(checkout, download_until=".venv/data-made")
    assert at(said, "set-up: making the virtual environment") < at(said, "-m venv")
    assert at(said, "set-up: installing the packages that make data") < at(said, "started uv")
    assert at(said, "set-up: installing the packages of training") < at(said, "torch")
    assert at(said, "set-up: compiling the machine code") < at(said, "-- prepared")


def test_data_are_made_while_packages_of_training_are_downloaded(checkout):
    # The stand-in for the download ends only when data were made.
    _, started = make(checkout, download_until=".venv/data-made")
    assert at(started, "lowalt sample") < at(started, "snakemake --cores all -- prepared")
    assert started.count("snakemake --cores all") == 1
    assert at(started, "-- prepared") < started.index("snakemake --cores all")


def test_set_up_alone_compiles_while_it_downloads(checkout):
    _, started = make(checkout, ".venv/set-up", download_until=".venv/sampling")
    assert (checkout / ".venv/set-up").is_file()
    assert not [line for line in started if line.startswith("snakemake")]


def test_bytecode_of_tests_is_written_while_machine_code_is_compiled(checkout):
    _, started = make(checkout, "-j2", "ready", compile_until=".venv/set-up-bytecode")
    compiled = at(started, "lowalt sample DJI Mini 2")
    overlays = ("urban.yaml", "town/config.yaml", "coarse.yaml")
    for later in (*overlays, "emulation avx2", "emulation x86-64-v2"):
        assert compiled < at(started, later)


def test_a_finished_download_starts_no_run_of_its_own(checkout):
    _, started = make(checkout)
    assert not [line for line in started if "prepared" in line]
    assert started.count("snakemake --cores all") == 1


def test_a_checkout_that_is_set_up_starts_only_the_run(checkout):
    make(checkout)
    said, started = make(checkout)
    assert started == ["snakemake --cores all"]
    assert not [line for line in said if "set-up" in line]
