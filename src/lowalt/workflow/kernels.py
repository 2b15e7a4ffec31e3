"""`python -m lowalt.workflow.kernels`: compile the machine code of data stages before their jobs ask for it.

Machine code is compiled once on each machine (`lowalt.machine.jit`), which takes most of a minute of processor time.
The first jobs of the echo and tiles stages would compile it one stage after the other. Here two processes do so at the
same time, with about as much work each: they run the stages' own commands on very small inputs. A job that starts
meanwhile waits for them.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from lowalt.config.command import run
from lowalt.config.layers import load_yaml
from lowalt.config.network import masts_m, station_names
from lowalt.files.errors import InputError

CONFIGURATION = Path("config/default.yaml")


def echo(config: dict, folder: Path) -> None:
    """Make the echoes of a motion model of each category in a folder."""
    from lowalt.echo.__main__ import main as echoes
    from lowalt.motion.__main__ import main as motion
    from lowalt.targets.__main__ import main as cloud
    from lowalt.targets.records import records_of

    records = records_of(config["targets"])
    first = {record["published"]["category"]: name for name, record in reversed(records.items())}
    clouds = [str(folder / f"{number}.npz") for number in range(len(first))]
    for name, path in zip(first.values(), clouds, strict=True):
        cloud(["--settings", json.dumps({"seed": 0, "record": records[name]}), "--out", path])
    published = {name: records[name]["published"] for name in first.values()}
    block = {key: value for key, value in config["motion"].items() if not key.startswith("models")}
    settings = {"seed": 0, "masts_m": masts_m(config["network"]), "motion": block, "published": published}
    table = str(folder / "motion.csv")
    span = ["--group", "seen", "--first", "0", "--count", "1"]
    motion(["--settings", json.dumps(settings), "--clouds", *clouds, *span, "--out", table])
    settings = json.dumps({"network": config["network"], "tolerance": None})
    station, out = station_names(config["network"])[0], str(folder / "echo.npy")
    echoes(["--settings", settings, "--motion", table, "--clouds", *clouds, "--station", station, "--out", out])


def tiles(config: dict, folder: Path) -> None:
    """Render and encode tiles of noise in a folder, reduced to the sizes of the configuration."""
    from lowalt.tiles.__main__ import main as render

    shape = (1, 2, len(config["network"]["stations"]), config["network"]["symbols"], 2)
    signals = folder / "noisy.npy"
    np.save(signals, np.random.default_rng(0).normal(size=shape).astype(np.float32).view(np.complex64)[..., 0])
    settings = json.dumps({name: config[name] for name in ("network", "spectra", "images")})
    reduced = [f"{size}={folder / str(size)}.npy" for size in config["tiles"]["reduced"]]
    render(["--settings", settings, "--signals", str(signals), "--reduced", *reduced, "--out", str(folder / "a.npz")])


STAGES = {"echo": echo, "tiles": tiles}


def main(arguments: list[str]) -> None:
    """Compile for the named stages, one after the other; without a name for each in a process of its own."""
    unknown = sorted(set(arguments) - set(STAGES))
    if unknown:
        raise InputError(f"lowalt.workflow.kernels: {unknown}, expected some of {list(STAGES)}")
    if not arguments:
        command = [sys.executable, "-m", "lowalt.workflow.kernels"]
        started = [subprocess.Popen([*command, stage]) for stage in STAGES]
        if any([process.wait() for process in started]):
            raise InputError("lowalt.workflow.kernels: a stage failed, see above")
        return
    with tempfile.TemporaryDirectory() as folder:
        for stage in arguments:
            STAGES[stage](load_yaml(CONFIGURATION), Path(folder))


if __name__ == "__main__":
    run(main)
