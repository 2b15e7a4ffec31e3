"""A release: one version everywhere; citation, recipe for conda and entry of the catalogue name
what is there.
"""

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml

import lowalt
from snakemake_runs import run

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text())
RECIPE = yaml.safe_load((ROOT / "envs/conda-forge/recipe.yaml").read_text())
CATALOGUE = yaml.safe_load((ROOT / ".snakemake-workflow-catalog.yml").read_text())
CONDA_NAMES = {"matplotlib": "matplotlib-base", "snakemake": "snakemake-minimal"}
"""Names of packages on conda-forge that differ from those on PyPI."""


def test_every_place_states_the_version_of_the_package():
    released = re.findall(
        r"^## (\d\S*?)(?:, (\S+))?$", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE
    )
    stated = {PROJECT["version"], CITATION["version"], RECIPE["context"]["version"], released[0][0]}
    assert stated == {lowalt.__version__}
    assert released[0][1] == str(CITATION["date-released"])


def test_the_citation_names_the_benchmark_by_the_configuration_that_makes_it():
    (data,) = [entry for entry in CITATION["references"] if entry["type"] == "data"]
    name = f"{data['title'].partition(':')[0]} {data['version']}".replace(" ", "-")
    config = yaml.safe_load((ROOT / f"config/{name}.yaml").read_text())
    assert config["run"] == name
    assert data["license"] == CITATION["license"] == PROJECT["license"]
    for entry in (CITATION, *CITATION["references"]):
        assert (
            entry["authors"]
            and entry["title"]
            and {"name", "family-names"} & set(entry["authors"][0])
        )


def on_conda(requirements: list[str]) -> list[str]:
    """Requirements of pyproject.toml as conda-forge writes them, sorted."""
    parts = [re.fullmatch(r"([\w.-]+?)((?:[<>=].*)?)", item).groups() for item in requirements]
    return sorted(f"{CONDA_NAMES.get(name, name)} {version}".strip() for name, version in parts)


def test_the_recipe_for_conda_asks_for_what_the_package_does():
    oldest = PROJECT["requires-python"].removeprefix(">=")
    assert RECIPE["context"]["python_min"] == oldest
    asked = RECIPE["requirements"]
    assert asked["run"][0] == "python >=${{ python_min }}"
    assert sorted(asked["run"][1:]) == on_conda(PROJECT["dependencies"])
    assert sorted(asked["run_constraints"]) == on_conda(
        PROJECT["optional-dependencies"]["workflow"]
    )
    build = tomllib.loads((ROOT / "pyproject.toml").read_text())["build-system"]["requires"]
    assert asked["host"] == [
        "python ${{ python_min }}.*",
        "pip",
        *(item.replace(">", " >") for item in build),
    ]
    commands = [f"{name} = {place}" for name, place in PROJECT["scripts"].items()]
    assert RECIPE["build"]["python"]["entry_points"] == commands
    assert (ROOT / "envs/conda-forge" / RECIPE["source"]["path"]).resolve() == ROOT.resolve()
    assert (ROOT / RECIPE["about"]["license_file"]).is_file() and RECIPE["about"][
        "license"
    ] == PROJECT["license"]
    assert RECIPE["about"]["summary"] == PROJECT["description"]


@pytest.mark.slow
def test_what_the_recipe_tries_runs(tmp_path):
    (commands,) = [entry["script"] for entry in RECIPE["tests"] if "script" in entry]
    (imports,) = [entry["python"]["imports"] for entry in RECIPE["tests"] if "python" in entry]
    program = Path(sys.executable).with_name("lowalt")
    lines = [line.replace("lowalt", str(program), 1) for line in commands]
    lines.append(f"{sys.executable} -c 'import {', '.join(imports)}'")
    for line in lines:
        ended = subprocess.run(line, shell=True, cwd=tmp_path, capture_output=True, text=True)
        assert ended.returncode == 0, ended.stderr
    assert list((tmp_path / "sample").glob("dji-mini-2-000000-*.png"))


def test_the_catalogue_of_workflows_finds_what_it_lists():
    """Its conditions for standardised usage. Source: README of
    snakemake/snakemake-workflow-catalog.
    """
    text = (ROOT / "README.md").read_text().lower()
    assert "snakemake" in text and "workflow" in text
    assert (ROOT / "workflow/Snakefile").is_file() and (ROOT / "config/README.md").is_file()
    rules = [path.name for path in (ROOT / "workflow/rules").iterdir() if path.is_file()]
    assert rules and all(name.endswith(".smk") for name in rules)
    usage = CATALOGUE["usage"]
    assert set(usage) == {"mandatory-flags", "software-stack-deployment", "report"}
    assert set(usage["mandatory-flags"]) == {"desc", "flags"}
    assert set(usage["software-stack-deployment"]) == {"conda", "apptainer", "apptainer+conda"}
    if usage["software-stack-deployment"]["conda"]:
        texts = [path.read_text() for path in (ROOT / "workflow/rules").glob("*.smk")]
        named = {name for text in texts for name in re.findall(r'conda:\n +"(.+)"', text)}
        assert named and all((ROOT / "workflow/rules" / name).is_file() for name in named)


@pytest.mark.slow
@pytest.mark.workflow
def test_a_workflow_deployed_from_the_catalogue_can_be_planned(tmp_path):
    """The folder that snakedeploy makes: configuration and profiles of the checkout, and its
    workflow as a module.
    """
    for name in ("config", "profiles"):
        shutil.copytree(ROOT / name, tmp_path / name)
    (tmp_path / "workflow").mkdir()
    (tmp_path / "workflow/Snakefile").write_text(
        'configfile: "config/config.yaml"\n\nmodule lowalt:\n    snakefile:'
        f' "{ROOT}/workflow/Snakefile"\n    config: config\n\nuse rule * from lowalt\n'
    )
    status, said = run(tmp_path, ["-n", "--cores", "1"], os.environ)
    assert status == 0, said[-3000:]
    assert {"train", "report"} <= {line.split()[0] for line in said.splitlines() if line.strip()}
