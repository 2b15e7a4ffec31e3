"""The pins: whatever the package names has one, the environment for conda has what jobs need at
these versions, and continuous integration runs the oldest and the newest versions that the package
promises."""

import re
import tomllib
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS = PROJECT["optional-dependencies"]
OF_JOBS = ("workflow", "recognition", "methods", "cost", "tensorboard", "town")
"""Extras whose packages a job of the workflow may import."""


def plain(requirement: str) -> str:
    """The name of a requirement as an index writes it: small letters, hyphens, no extras and no
    version.
    """
    return re.sub(r"[-_.]+", "-", re.match(r"[\w.-]+", requirement)[0]).lower()


def pins(lines: list[str]) -> dict[str, str]:
    """Version by name of lines NAME==VERSION; a name that stands twice, or a line of another form,
    is an error.
    """
    found: dict[str, str] = {}
    for line in lines:
        name, version = re.fullmatch(r"([\w.-]+)==([\w.+!]+)", line).groups()
        assert plain(name) not in found, line
        found[plain(name)] = version
    return found


@pytest.fixture(scope="module")
def constraints():
    lines = (ROOT / "envs/constraints.txt").read_text().splitlines()
    return pins([line for line in lines if line and not line.startswith("#")])


def test_every_package_that_pyproject_names_has_a_pin(constraints):
    asked = [plain(item) for items in (PROJECT["dependencies"], *EXTRAS.values()) for item in items]
    assert len(asked) > 40
    assert sorted(set(asked) - set(constraints)) == []


def test_the_environment_for_conda_holds_what_jobs_need_at_the_pinned_versions(constraints):
    listed = yaml.safe_load((ROOT / "envs/environment.yaml").read_text())["dependencies"]
    packages = pins(listed[-1]["pip"])
    needed = {
        plain(item)
        for items in (PROJECT["dependencies"], *(EXTRAS[name] for name in OF_JOBS))
        for item in items
    }
    assert packages == {name: constraints[name] for name in needed}
    oldest = PROJECT["requires-python"].removeprefix(">=")
    assert f"python={oldest}" in listed


def test_continuous_integration_runs_the_oldest_and_the_newest_that_is_promised(constraints):
    jobs = yaml.safe_load((ROOT / ".github/workflows/ci.yml").read_text())["jobs"]
    runs = {
        name: [step["run"] for step in job["steps"] if "run" in step] for name, job in jobs.items()
    }
    assert runs == {
        "tests": [".ci/run"],
        "numpy": [".ci/numpy.sh"],
        "snakemake": [".ci/snakemake.sh"],
    }
    pythons = jobs["tests"]["strategy"]["matrix"]["python"]
    assert pythons[0] == PROJECT["requires-python"].removeprefix(">=")
    (asked,) = [item for item in PROJECT["dependencies"] if plain(item) == "numpy"]
    oldest, below = re.fullmatch(r"numpy>=([\d.]+),<([\d.]+)", asked).groups()
    first, last = re.search(
        r'^NUMPYS="(\S+) (\S+)"$', (ROOT / ".ci/numpy.sh").read_text(), re.MULTILINE
    ).groups()
    assert first == f"{oldest}.0" and last == constraints["numpy"]
    # The newest lies in the last minor version below the bound.
    assert int(last.split(".")[1]) + 1 == int(below.split(".")[1])
    (snakemake,) = [item for item in EXTRAS["workflow"] if plain(item) == "snakemake"]
    (oldest,) = re.findall(
        r"^OLDEST_SNAKEMAKE=(\S+)$", (ROOT / ".ci/snakemake.sh").read_text(), re.MULTILINE
    )
    assert snakemake.removeprefix("snakemake>=") + ".0" == oldest
    assert (
        f'min_version("{snakemake.removeprefix("snakemake>=")}")'
        in (ROOT / "Snakefile").read_text()
    )
