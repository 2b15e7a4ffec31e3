"""The step that compiles machine code ahead runs the stages' own commands, and fails loudly where they do."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from lowalt.config.layers import load_yaml
from lowalt.files.errors import InputError
from lowalt.workflow import kernels

ROOT = Path(__file__).parent.parent


@pytest.fixture
def config(monkeypatch):
    monkeypatch.chdir(ROOT)
    return load_yaml(kernels.CONFIGURATION)


def test_smallest_inputs_pass_the_commands_of_echo_and_tiles(config, tmp_path):
    config["cost"]["tolerances"] = [1e-3, 1e-12]
    kernels.echo(config, tmp_path)
    exact = np.load(tmp_path / "echo.npy")
    kernels.tiles(config, tmp_path)
    kernels.tolerances(config, tmp_path)
    fast = np.load(tmp_path / "echo.npy")
    assert exact.shape == fast.shape == (4, 400)
    assert 0 < abs(fast - exact).max() < 1e-2 * abs(exact).max()
    assert len(list(tmp_path.glob("?.npz"))) == 4
    # Two samples of nine images.
    assert np.load(tmp_path / "24.npy").shape == (2, 9, 24, 24)


def test_a_stage_that_fails_is_no_success(config, monkeypatch):
    with pytest.raises(InputError, match="ech"):
        kernels.main(["ech"])
    monkeypatch.setattr(kernels.sys, "executable", "/bin/false")
    with pytest.raises(InputError, match="failed"):
        kernels.main([])


def test_named_stages_are_compiled_here_and_all_of_them_in_two_processes(config, monkeypatch):
    done, started = [], []
    for name in ("tiles", "tolerances"):
        monkeypatch.setattr(
            kernels, name, lambda given, folder, name=name: done.append((name, given == config, folder.is_dir()))
        )
    ended = SimpleNamespace(wait=lambda: 0)
    monkeypatch.setattr(kernels.subprocess, "Popen", lambda command: started.append(command[1:]) or ended)
    kernels.main(["tiles", "tolerances"])
    assert done == [("tiles", True, True), ("tolerances", True, True)] and not started
    kernels.main([])
    assert started == [["-m", "lowalt.workflow.kernels", *stages] for stages in (["echo"], ["tiles", "tolerances"])]
    assert len(done) == 2
    assert sorted(stage for stages in kernels.PROCESSES for stage in stages) == sorted(kernels.STAGES)
