"""The definitions of containers hold all that a run reads, and install what it needs: shown without
a container engine.

Instructions and copied files are read from envs/; a dry run, or make, stands on those files alone.
"""

import json
import os
import re
import shlex
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

from snakemake_runs import run

ROOT = Path(__file__).parents[1]
OFFLINE = "benchmark.Dockerfile"
"""Built and run without a network, from wheels."""


def instructions(file: str = "Dockerfile") -> list[tuple[str, str]]:
    """Instruction and rest of every line of a file of envs/ that is neither empty nor a comment."""
    text = (ROOT / "envs" / file).read_text().replace("\\\n", " ")
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    return [tuple(line.split(maxsplit=1)) for line in lines]


def copied(folder: Path, file: str = "Dockerfile") -> Path:
    """The working directory of a container as its COPY lines make it."""
    for name, rest in instructions(file):
        if name == "COPY":
            *sources, target = rest.split()
            for source in sources:
                place = folder / target / (source if target == "./" else "")
                place.parent.mkdir(parents=True, exist_ok=True)
                ignored = shutil.ignore_patterns("__pycache__", "*.egg-info")
                if (ROOT / source).is_dir():
                    shutil.copytree(ROOT / source, folder / target, ignore=ignored)
                else:
                    shutil.copy(ROOT / source, place)
    return folder


def test_run_lines_are_shell_and_install_extras_that_exist_from_files_copied_before():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"][
        "optional-dependencies"
    ]
    there: set[str] = set()
    for name, rest in instructions():
        if name == "COPY":
            there |= set(rest.split()[:-1])
        if name == "RUN":
            subprocess.run(["bash", "-n", "-c", rest], check=True)
            words = shlex.split(rest)
            if "pip" in words:
                asked = re.fullmatch(r"\.\[(.*)\]", words[-1])[1].split(",")
                assert {"workflow", "recognition"} <= set(asked) <= set(extras)
                assert {"pyproject.toml", "src", "envs"} <= there


def test_packages_of_the_system_exist_in_the_release_that_the_image_stands_on():
    """Asked of Debian's own index, on a machine of that release."""
    release = dict(
        line.split("=", 1)
        for line in Path("/etc/os-release").read_text().splitlines()
        if "=" in line
    )
    if instructions()[0][1].rpartition("-")[2] != release.get(
        "VERSION_CODENAME"
    ) or not shutil.which("apt-cache"):
        pytest.skip("this machine has another release than the image")
    lines = [rest for name, rest in instructions() if name == "RUN" and "apt-get install" in rest]
    words = [
        word
        for line in lines
        for word in line.partition("apt-get install")[2].partition("&&")[0].split()
    ]
    packages = [word for word in words if not word.startswith("-")]
    assert packages

    # One question for all: each reads the whole index.
    answer = subprocess.run(
        ["apt-cache", "policy", "libgl-dev", *packages], capture_output=True, text=True
    ).stdout
    offered = re.findall(r"^(\S+):\n  Installed: .*\n  Candidate: \d", answer, re.MULTILINE)
    if "libgl-dev" not in offered:
        pytest.skip("no index of Debian's packages is here")
    assert [package for package in packages if package not in offered] == []


def test_the_offline_container_asks_only_for_the_folder_of_wheels_and_makes_a_target_of_make(
    tmp_path,
):
    """With every target that it names, make finds its files among those copied, and would install
    what pip fetched.
    """
    found = instructions(OFFLINE)
    settings = dict(
        pair.split("=") for name, rest in found if name == "ENV" for pair in rest.split()
    )
    mounts = []
    targets = []
    for name, rest in found:
        if name == "RUN":
            mount, command = re.fullmatch(
                r"--mount=type=bind,source=wheels,target=(\S+) make (\S+)", rest
            ).groups()
            mounts.append(mount)
            targets.append(command)
    assert settings == {
        "PIP_NO_INDEX": "1",
        "PIP_FIND_LINKS": mounts[0],
        "UV_NO_INDEX": "1",
        "UV_OFFLINE": "1",
        "UV_FIND_LINKS": mounts[0],
    }
    (entry,), (default,) = (
        json.loads(rest) for kind in ("ENTRYPOINT", "CMD") for name, rest in found if name == kind
    )
    assert entry == "make"
    folder = copied(tmp_path / "lowalt", OFFLINE)
    for target in (*targets, default):
        run = subprocess.run(
            ["make", "--dry-run", target], cwd=folder, capture_output=True, text=True
        )
        assert run.returncode == 0, run.stderr
    text = (ROOT / "envs" / OFFLINE).read_text()
    fetched = re.search(
        r"pip wheel --wheel-dir wheels -c envs/constraints.txt (.*) '\.\[(.*)\]'", text
    )
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"][
        "optional-dependencies"
    ]
    assert {"pip", "uv", "setuptools"} == set(fetched[1].split())
    assert {"workflow", "cost", "recognition"} <= set(fetched[2].split(",")) <= set(extras)


@pytest.mark.workflow
def test_a_run_can_be_planned_from_what_the_container_holds(tmp_path):
    folder = copied(tmp_path / "lowalt")
    environment = os.environ | {"PYTHONPATH": str(folder / "src")}
    status, text = run(
        folder, ["-n", "--cores", "all", "--configfile", "config/tiny.yaml"], environment
    )
    assert status == 0, text[-3000:]
    assert {"train", "report"} <= {line.split()[0] for line in text.splitlines() if line.strip()}
