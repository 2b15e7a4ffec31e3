"""Training over two nodes: two launchers of torchrun, one process each, do what two processes of one node do."""

import json
import os
import subprocess
import sys

import pytest

from lowalt.recognition import schemes
from lowalt.workflow.launch import Launch
from trainings import with_training

pytestmark = pytest.mark.slow


def launched(lines, processes):
    """Run one training under a launcher for each command line, with so many processes each.

    Returns the exit status and the text of each launcher.
    """
    nodes = len(lines)
    port = str(20000 + os.getpid() % 20000 + nodes)
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "GLOO_SOCKET_IFNAME": "lo"}
    launchers = []
    for node, arguments in enumerate(lines):
        command = [sys.executable, "-m", "torch.distributed.run", "--nnodes", str(nodes), "--node-rank", str(node)]
        command += ["--nproc-per-node", str(processes), "--master-addr", "127.0.0.1", "--master-port", port]
        command += ["-m", "lowalt.recognition", *arguments]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        launchers.append(subprocess.Popen(command, env=environment, **pipes))
    texts = [launcher.communicate(timeout=300)[0] for launcher in launchers]
    return [(launcher.returncode, text) for launcher, text in zip(launchers, texts, strict=True)]


def trained(lines, processes):
    """The same, where all must end well."""
    for status, text in launched(lines, processes):
        assert status == 0, text[-3000:]


def test_the_workflow_s_launcher_trains_to_the_bytes_of_plain_torchrun(views, tmp_path):
    """The words that the rule `train` puts between `python -m` and the module (`recognition.processes: 2`)."""
    settings = json.dumps(with_training(steps=4, validate_every=2))
    line = ["train", "--settings", settings, "--views", str(views), "--protocol", "seen", "--scheme", "A:VRP"]
    table = tmp_path / "schemes.csv"
    table.write_text(",".join(schemes.COLUMNS) + "\nA:VRP,A,VRP,attention,,seen\n")
    line += ["--stations", "A", "B", "C", "--schemes", str(table), "--out"]
    trained([[*line, str(tmp_path / "plain")]], 2)
    words = Launch.of({"processes": 2}).words
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
        trained(nodes * [line], processes)
        assert json.loads((tmp_path / name / "run.json").read_text())["ranks"] == 2
    for name in ("model.pt", "history.csv"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes(), name


def test_nodes_that_train_unlike_things_are_told_instead_of_mixing_their_gradients(views, tmp_path):
    table = tmp_path / "schemes.csv"
    table.write_text(",".join(schemes.COLUMNS) + "\nA:VRP,A,VRP,attention,,seen\n")
    lines = []
    for precision in ("fp32", "bf16"):
        settings = json.dumps(with_training(steps=2, validate_every=2, precision=precision))
        line = ["train", "--settings", settings, "--views", str(views), "--protocol", "seen", "--scheme", "A:VRP"]
        lines.append([*line, "--stations", "A", "B", "C", "--schemes", str(table), "--out", str(tmp_path / "out")])
    found = launched(lines, 1)
    assert all(status for status, _ in found)
    assert any("stands at step 0, another rank differs in that" in text for _, text in found), found
    assert not (tmp_path / "out/model.pt").exists()
