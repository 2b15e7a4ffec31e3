"""The echo command: a motion table and clouds in, complex64 signals out, and its faults by name."""

import json
import subprocess
import sys

import numpy as np
import pytest

from craft import NETWORK, craft, row
from lowalt.config.network import Network
from lowalt.echo import echo_signal, echo_signals
from lowalt.echo.__main__ import main
from lowalt.echo.echo_input import Rigid, target
from lowalt.files.errors import InputError
from lowalt.motion import poses, positions, write_table
from lowalt.targets.cloud import write


def command(folder, **changes) -> list[str]:
    given = {
        "--settings": json.dumps({"network": NETWORK, "tolerance": None}),
        "--motion": str(folder / "chunk.csv"),
        "--clouds": str(folder / "craft.npz"),
        "--station": "B",
        "--out": str(folder / "B.npy"),
    } | changes
    return [text for option, value in given.items() for text in (option, *value.split("|"))]


@pytest.fixture
def folder(tmp_path):
    write(tmp_path / "craft.npz", craft())
    write_table(tmp_path / "chunk.csv", [row(0), row(1)])
    return tmp_path


def test_signals_are_those_of_the_positions(folder):
    main(command(folder))
    found = np.load(folder / "B.npy")
    assert found.shape == (2, 30) and found.dtype == np.complex64
    network = Network.from_settings(NETWORK)
    for model in (0, 1):
        track = positions(craft(), row(model), network.times_s)
        aim = [row(model)[name] for name in ("x_m", "y_m", "z_m")]
        truth = echo_signal(network, network.station("B"), track, 1.0, aim).signal
        assert abs(found[model] - truth).max() < 1e-6 * abs(truth).max()


def test_stations_heard_together_are_those_heard_alone(folder):
    main(command(folder))
    alone = (folder / "B.npy").read_bytes()
    main(
        command(folder, **{"--station": "A|B", "--out": f"{folder}/both-A.npy|{folder}/both-B.npy"})
    )
    assert (folder / "both-B.npy").read_bytes() == alone != (folder / "both-A.npy").read_bytes()
    with pytest.raises(InputError, match="--out: 1 files, expected one for each of the stations"):
        main(command(folder, **{"--station": "A|B"}))


def test_a_target_checked_once_serves_every_station():
    network = Network.from_settings(NETWORK)
    motion = Rigid(*poses(craft(), row(0), network.times_s), craft().points, craft().part)
    aim = [row(0)[name] for name in ("x_m", "y_m", "z_m")]
    seen = target(motion, 1.0)
    together = echo_signals(network, motion, 1.0, aim)
    assert together.shape == (len(network.stations), network.symbols)
    for station, signal in zip(network.stations, together, strict=True):
        alone = echo_signal(network, station, motion, 1.0, aim).signal
        assert (echo_signal(network, station, seen, None, aim).signal == alone).all()
        assert (signal == alone).all()


def test_a_job_whose_kernels_are_compiled_loads_no_compiler(folder):
    main(command(folder))
    code = (
        "import sys; from lowalt.echo.__main__ import main; main(sys.argv[1:]); print(*sys.modules)"
    )
    again = subprocess.run(
        [sys.executable, "-c", code, *command(folder)], capture_output=True, text=True, check=True
    )
    loaded = again.stdout.split()
    assert "numba" in loaded and not {
        "numba.np.linalg",
        "numba.np.random.generator_core",
        "scipy.linalg",
    } & set(loaded)


def test_faults_are_named_and_leave_nothing_behind(folder):
    close, loose = (json.dumps({"network": NETWORK, "tolerance": value}) for value in (1e-15, 2))
    for changes, said in (
        ({"--settings": "{}"}, r"missing \['network', 'tolerance'\]"),
        ({"--station": "D"}, "station 'D': not in the network"),
        ({"--settings": loose}, "tolerance is 2"),
        ({"--settings": close}, r"DJI Mini 2, model 0, station B: .*below the floor"),
    ):
        with pytest.raises(InputError, match=said):
            main(command(folder, **changes))
    write_table(folder / "chunk.csv", [row(0) | {"subtype": "Crow"}])
    with pytest.raises(InputError, match="Crow, model 0: no cloud"):
        main(command(folder))
    assert not list(folder.glob("*.npy"))
