"""The tutorial on an extension runs as it is printed: the package of the example is installed with
pip into a virtual environment of its own, and what it adds is used.
"""

import os
import shlex
import shutil
import subprocess
import sys
import venv
from pathlib import Path

import pytest

from followed_pages import FENCE, FOLDER, ROOT
from lowalt.files.package_plan import PACKAGE

BLOCKS = FENCE.findall((FOLDER / "extension.md").read_text())
EXAMPLE = ROOT / "examples/extension"
COPY = "cp -r examples/extension mist"
LOSS = """
import lowalt, numpy as np
from lowalt.config.layers import overlaid
powers = []
for effects in ({"mist": {"db_per_km": 2.0}}, {}):
    config = overlaid(["misty.yaml"])
    config["effects"] = effects
    config["targets"]["select"] = ["DJI Mini 2"]
    made = lowalt.Dataset(config)
    row = made.row(made.place(0))
    signal = made.maker.received(row, stations=[0])[0][0]
    powers.append(np.mean(abs(signal) ** 2))
mast = made.maker.network.stations[0].position_m
way_m = np.linalg.norm(np.subtract([row["x_m"], row["y_m"], row["z_m"]], mast))
print(10 * np.log10(powers[1] / powers[0]), 2 * way_m)
"""
"""Decibels that the mist takes from an echo, and the way out and back (m)."""


class Own(venv.EnvBuilder):
    """Makes a virtual environment that finds the packages of this one, and this checkout's lowalt."""

    def post_setup(self, context) -> None:
        """Add the folders of packages as site-packages of the new environment."""
        folders = [path for path in sys.path if path.endswith("site-packages")]
        (site,) = Path(context.env_dir).glob("lib/python*/site-packages")
        adding = "".join(f"import site; site.addsitedir({path!r})\n" for path in folders)
        (site / "outer.pth").write_text(f"{PACKAGE.parent}\n{adding}")


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """A folder with the copied example and the files that the page names, the package installed as
    the page says; returns a function that runs a command line of the page there.
    """
    folder = tmp_path_factory.mktemp("own")
    assert COPY in lines()
    shutil.copytree(EXAMPLE, folder / "mist")
    for _, title, block in BLOCKS:
        if title and title != "entry":
            (folder / title).write_text(block)
    Own().create(folder / "environment")
    environment = {**os.environ, "PIP_NO_INDEX": "1"}
    environment.pop("PYTHONPATH", None)
    python = str(folder / "environment/bin/python")

    def run(line: str) -> str:
        """What a line prints, in the environment of the package."""
        words = shlex.split(line)
        told = [python, *words[1:]]
        if words[0].endswith("lowalt"):
            told = [python, "-m", "lowalt", *words[1:]]
        ran = subprocess.run(told, cwd=folder, env=environment, capture_output=True, text=True)
        assert not ran.returncode, ran.stderr
        return ran.stdout

    (install,) = [line for line in lines() if "pip install" in line]
    run(install)
    return run


def lines() -> list[str]:
    """The command lines of the page."""
    return [line for kind, _, block in BLOCKS if kind == "sh" for line in block.splitlines()]


def test_the_page_shows_lines_of_the_example_and_links_each_of_its_files():
    files = [path for path in EXAMPLE.rglob("*.*") if path.suffix in (".py", ".toml")]
    whole = "".join(path.read_text() for path in files)
    shown = [block for _, title, block in BLOCKS if title == "entry"]
    assert len(shown) == 2 and all(block in whole for block in shown)
    page = (FOLDER / "extension.md").read_text()
    names = [path.relative_to(ROOT).as_posix() for path in files]
    assert len(names) == 5 and all(f"](../../{name})" in page for name in names)


def test_the_package_adds_an_effect_a_spectrum_and_a_command(package):
    said = {line: package(line) for line in lines() if line.startswith(".venv/bin/lowalt")}
    brought = "mist (package lowalt-mist): commands mist; effects mist; spectra power"
    assert brought in said[".venv/bin/lowalt --help"]
    # 0.4 dB/km over 500 m are 0.2 dB.
    assert f"{10 ** (-0.2 / 20):.4f}" in said[".venv/bin/lowalt mist 500"]
    (explained,) = [text for line, text in said.items() if " explain " in line]
    assert "ITU-R P.840" in explained
    (spectra,) = [text for line, text in said.items() if " spectra " in line]
    assert "power" in spectra


def test_the_effect_takes_its_decibels_from_an_echo(package):
    lost_db, way_m = map(float, package(shlex.join(["python", "-c", LOSS])).split())
    assert lost_db == pytest.approx(2.0 * way_m / 1000, rel=0.02)
