"""A training over two Slurm nodes has the bytes of two processes of one machine, and asks for what it needs.

Needs a Slurm of at least two nodes (`sinfo`); the test of what is asked for needs none.
"""

import json
import os
import re
import subprocess
import sys

import pytest
import yaml
from test_workflow import workplace
from test_workflow_extension import BASE
from test_workflow_slurm import OVERLAY, ask, needs_slurm, refusing, submit

pytestmark = [pytest.mark.workflow, pytest.mark.slow]
__all__ = ["refusing"]


LITTLE = ["train:runtime=20", "train:mem_mb=2000", "evaluate:runtime=20", "evaluate:mem_mb=2000"]
"""A small queue lets no job run for the profile's four hours of a training."""

# A training over two nodes with two processes and GPUs each, and its evaluation in the same job.
OVER_NODES = """
from lowalt.workflow.launch import Launch


rule evaluate:
    input:
        "model.txt",
    output:
        "made.txt",
    resources:
        **Launch(4, 2, True).evaluation,
    shell:
        "touch {output}"


rule train:
    output:
        "model.txt",
    threads: Launch(4, 2, True).per_node
    resources:
        **Launch(4, 2, True).training,
    shell:
        "touch {output}"
"""


def test_a_training_over_nodes_asks_for_a_task_with_cores_and_gpus_on_each(refusing, tmp_path):
    status, said = submit(tmp_path, "--retries", "0", snakefile=OVER_NODES)
    (line,) = refusing()
    assert status, said
    for words in ("--nodes=2", "--ntasks=2", "--cpus-per-task=2", "--gres=gpu:2"):
        assert f"{words} " in line, line
    assert "--gpus" not in line and "per-gpu" not in line


@needs_slurm
def test_a_training_over_two_nodes_has_the_bytes_of_two_processes_here(tmp_path):
    """The same folder twice: the change of nodes makes the training again, in the queue."""
    workplace(tmp_path)
    (tmp_path / "src/sitecustomize.py").unlink()
    trained = {
        "size": 24,
        "schemes": ["A:VRP"],
        "protocols": ["seen"],
        "processes": 2,
        "training": {"steps": 6, "validate_every": 3},
    }
    overlay = OVERLAY | {"targets": {"select": [*BASE["targets"]["select"], "NIO ET5T 2023"]}, "recognition": trained}
    environment = os.environ | {"PYTHONPATH": str(tmp_path / "src"), "GLOO_SOCKET_IFNAME": "lo"}
    made, found, said = tmp_path / "results/test/models/seen/a-vrp/0", {}, ""
    for count in (1, 2):
        overlay["recognition"]["nodes"] = count
        (tmp_path / "overlay.yaml").write_text(yaml.safe_dump(overlay))
        queue = ["--workflow-profile", "profiles/slurm", "--slurm-status-command", "squeue", "--set-resources", *LITTLE]
        where = queue if count == 2 else ["--cores", "2"]
        command = [sys.executable, "-m", "snakemake", *where, "--configfile", "overlay.yaml", "--", "models"]
        run = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
        said = run.stdout + run.stderr
        assert run.returncode == 0, said[-3000:]
        assert json.loads((made / "run.json").read_text())["ranks"] == 2
        found[count] = [(made / name).read_bytes() for name in ("model.pt", "history.csv")]
    # The path of a log begins with this test's folder, whose name holds the same word.
    jobs = re.findall(r"SLURM jobid (\d+) \(log: \S+/\.snakemake/(\S+)/\d+\.log\)", said)
    (job,) = [job for job, path in jobs if "training" in path]
    assert re.search(r"NumNodes=2\b.* NumTasks=2\b", ask("scontrol", "show", "job", job))
    assert found[1] == found[2]
