"""The step that compiles machine code ahead runs the stages' own commands, and fails loudly where they do."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from lowalt.config.layers import load_yaml
from lowalt.files.errors import InputError
from lowalt.workflow import kernels

ROOT = Path(__file__).parents[2]


@pytest.fixture
def config(monkeypatch):
    monkeypatch.chdir(ROOT)
    return load_yaml(kernels.CONFIGURATION)


def test_smallest_inputs_pass_the_commands_of_echo_and_tiles(config, tmp_path):
    kernels.echo(config, tmp_path)
    assert np.load(tmp_path / "echo.npy").shape == (4, 400)
    assert len(list(tmp_path.glob("?.npz"))) == 4
    kernels.tiles(config, tmp_path)
    # Two samples of nine images.
    assert np.load(tmp_path / "24.npy").shape == (2, 9, 24, 24)


def test_a_stage_that_fails_is_no_success(config, monkeypatch):
    with pytest.raises(InputError, match="ech"):
        kernels.main(["ech"])
    monkeypatch.setattr(kernels.sys, "executable", "/bin/false")
    with pytest.raises(InputError, match="failed"):
        kernels.main([])


def test_named_stages_are_compiled_here_and_all_of_them_in_a_process_each(config, monkeypatch):
    done, started = [], []
    for name in kernels.STAGES:
        monkeypatch.setitem(
            kernels.STAGES, name, lambda block, folder, name=name: done.append((name, block == config, folder.is_dir()))
        )
    ended = SimpleNamespace(wait=lambda: 0)
    monkeypatch.setattr(kernels.subprocess, "Popen", lambda command: started.append(command[1:]) or ended)
    kernels.main(["tiles"])
    assert done == [("tiles", True, True)] and not started
    kernels.main([])
    assert started == [["-m", "lowalt.workflow.kernels", stage] for stage in ("echo", "tiles")] and len(done) == 1
