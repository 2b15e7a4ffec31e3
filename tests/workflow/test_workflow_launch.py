"""A training's launch: its command, the resources that its job requests from the queue, and refused settings."""

import os
import socket
import sys
from types import SimpleNamespace

import pytest

from configured import run_of
from lowalt.files.errors import InputError
from lowalt.recognition import nodes
from lowalt.workflow.launch import Launch


def test_a_training_of_several_processes_is_launched_by_torchrun_and_one_of_one_is_not():
    assert run_of().launch == Launch(1, 1, False) and run_of().launch.words == []
    assert Launch.of({}) == Launch(1, 1, False)
    launch = run_of({"recognition": {"processes": 4}}).launch
    assert launch.words == ["torch.distributed.run", "--standalone", "--nproc-per-node", "4", "-m"]
    assert launch.training == {"gpu": 0} and launch.per_node == 4
    launch = run_of({"recognition": {"processes": 4, "gpu": True}}).launch
    assert (launch.training, launch.evaluation) == ({"gpu": 4}, {"gpu": 1})


def test_nodes_share_the_processes_evenly_and_ask_for_a_task_and_gpus_a_node():
    launch = run_of({"recognition": {"processes": 6, "nodes": 2}}).launch
    assert (launch.words, launch.per_node) == (["lowalt.recognition.nodes", "2", "3"], 3)
    tasks = {"nodes": 2, "tasks": 2, "mpi": "srun", "tasks_per_gpu": 0, "gpu": 0}
    assert (launch.training, launch.evaluation) == (tasks, {"gpu": 0})
    launch = Launch(6, 2, True)
    assert launch.training == tasks | {"gres": "gpu:3"} and launch.evaluation == {"gpu": 0, "gres": "gpu:3"}


def test_nodes_without_slurm_are_refused_before_the_first_job(monkeypatch):
    monkeypatch.delenv("SLURM_JOB_ID", raising=False)
    here, elsewhere = SimpleNamespace(local_exec=True), SimpleNamespace(local_exec=False)
    Launch(2, 1, False).before(here)
    Launch(2, 2, False).before(elsewhere)
    with pytest.raises(InputError, match=r"recognition\.nodes: 2, but .*--workflow-profile profiles/slurm"):
        Launch(2, 2, False).before(here)
    monkeypatch.setenv("SLURM_JOB_ID", "7")
    Launch(2, 2, False).before(here)


@pytest.fixture
def srun(tmp_path, monkeypatch):
    """An srun that prints its arguments, one a line, into a file, and fails where a file `fails` is there; a store
    without torch, which takes seconds to import."""
    tool = tmp_path / "srun"
    tool.write_text(f'#!/bin/sh\nprintf "%s\\n" "$@" > "{tmp_path}/asked"\ntest ! -e "{tmp_path}/fails" || exit 7\n')
    tool.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    monkeypatch.setenv("SLURM_JOB_ID", "7")
    stores = SimpleNamespace(TCPStore=lambda host, port, is_master, wait_for_workers: SimpleNamespace(port=4321))
    monkeypatch.setitem(sys.modules, "torch.distributed", stores)
    monkeypatch.setitem(sys.modules, "torch", SimpleNamespace(distributed=stores))
    return tmp_path


def test_srun_starts_a_torchrun_a_node_with_the_cores_of_its_processes(srun, monkeypatch, capsys):
    monkeypatch.setenv("OMP_NUM_THREADS", "6")
    module = ["lowalt.recognition", "train", "--out", "a folder/ä"]
    nodes.main(["2", "3", *module])
    asked = (srun / "asked").read_text().splitlines()
    step, rest = asked[: asked.index("sh")], asked[asked.index("sh") :]
    assert {"--nodes=2", "--ntasks=2", "--ntasks-per-node=1", "--cpus-per-task=6", "--kill-on-bad-exit=1"} <= set(step)
    assert rest[-len(module) - 1 :] == ["-m", *module]
    assert rest[rest.index("torch.distributed.run") - 1] == "-m"
    assert {"--nnodes=2", "--nproc-per-node=3", "--rdzv-id=7", "--rdzv-conf=is_host=0"} <= set(rest)
    assert f"--rdzv-endpoint={socket.gethostname()}:4321" in rest
    (srun / "fails").touch()
    with pytest.raises(SystemExit) as ended:
        nodes.main(["2", "3", *module])
    assert ended.value.code == 7 and "has the Slurm job 7 so many nodes" in capsys.readouterr().err


def test_nodes_outside_slurm_are_refused_in_a_sentence(srun, monkeypatch):
    monkeypatch.setenv("PATH", str(srun / "none"))
    with pytest.raises(InputError, match="srun is not installed"):
        nodes.main(["2", "1", "x"])
    monkeypatch.delenv("SLURM_JOB_ID")
    with pytest.raises(InputError, match="SLURM_JOB_ID is not set"):
        nodes.main(["2", "1", "x"])
    assert not (srun / "asked").exists()
