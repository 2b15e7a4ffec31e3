"""Training over two nodes: two launchers of torchrun, one process each, do what two processes of one node do."""

import json
import os
import subprocess
import sys
from types import SimpleNamespace

import pytest

from lowalt.recognition import schemes
from lowalt.workflow.run import Run
from trainings import with_training

pytestmark = pytest.mark.slow


def launched(arguments, nodes, processes):
    """Run one training under `nodes` launchers with so many processes each; all must end well."""
    port = str(20000 + os.getpid() % 20000 + nodes)
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "GLOO_SOCKET_IFNAME": "lo"}
    launchers = []
    for node in range(nodes):
        command = [sys.executable, "-m", "torch.distributed.run", "--nnodes", str(nodes), "--node-rank", str(node)]
        command += ["--nproc-per-node", str(processes), "--master-addr", "127.0.0.1", "--master-port", port]
        command += ["-m", "lowalt.recognition", *arguments]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        launchers.append(subprocess.Popen(command, env=environment, **pipes))
    for launcher in launchers:
        said = launcher.communicate(timeout=300)[0]
        assert launcher.returncode == 0, said[-3000:]


def test_the_workflow_s_launcher_trains_to_the_bytes_of_plain_torchrun(views, tmp_path):
    """The words that the rule `train` puts between `python -m` and the module (`recognition.processes: 2`)."""
    settings = json.dumps(with_training(steps=4, validate_every=2))
    line = ["train", "--settings", settings, "--views", str(views), "--protocol", "seen", "--scheme", "A:VRP"]
    table = tmp_path / "schemes.csv"
    table.write_text(",".join(schemes.COLUMNS) + "\nA:VRP,A,VRP,attention,,seen\n")
    line += ["--stations", "A", "B", "C", "--schemes", str(table), "--out"]
    launched([*line, str(tmp_path / "plain")], 1, 2)
    config = SimpleNamespace(config={"recognition": {"processes": 2}})
    words = Run.launcher.fget(SimpleNamespace(processes=Run.processes.fget(config))).split()
    command = [sys.executable, "-m", *words, "lowalt.recognition", *line, str(tmp_path / "rule")]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "GLOO_SOCKET_IFNAME": "lo"}
    run = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stderr[-3000:]
    assert json.loads((tmp_path / "rule/run.json").read_text())["ranks"] == 2
    assert (tmp_path / "rule/model.pt").read_bytes() == (tmp_path / "plain/model.pt").read_bytes()


def test_two_nodes_of_one_process_train_to_the_bytes_of_one_node_of_two(views, tmp_path):
    table = tmp_path / "schemes.csv"
    table.write_text(",".join(schemes.COLUMNS) + "\nAB:VRP+VT,AB,VRP+VT,attention,,seen\n")
    settings = json.dumps(with_training(steps=12, validate_every=6))
    for name, nodes, processes in (("one", 1, 2), ("two", 2, 1)):
        line = ["train", "--settings", settings, "--views", str(views), "--protocol", "seen", "--scheme", "AB:VRP+VT"]
        line += ["--stations", "A", "B", "C", "--schemes", str(table), "--out", str(tmp_path / name)]
        launched(line, nodes, processes)
        assert json.loads((tmp_path / name / "run.json").read_text())["ranks"] == 2
    for name in ("model.pt", "history.csv"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes(), name
