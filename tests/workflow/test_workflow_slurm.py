"""A data set, and a training, over two Slurm nodes have the bytes of local ones, and a lost node costs its jobs only.

Needs a Slurm of at least two nodes (`sinfo`) that this user may take down and up again; elsewhere tests are skipped.
The tests of what is asked for need none.
"""

import os
import re
import shutil
import subprocess
import sys
import time

import pytest
import yaml
from test_workflow import ROOT, checksums, snakemake, workplace
from test_workflow_extension import BASE

pytest.importorskip("snakemake_executor_plugin_slurm")
pytestmark = [pytest.mark.workflow, pytest.mark.slow]

OVERLAY = BASE | {"motion": BASE["motion"] | {"models": 40}}
CHUNKS = 8


def ask(*command):
    return subprocess.run(command, capture_output=True, text=True).stdout


NODES = ask("sinfo", "-h", "-N", "-o", "%N").split() if shutil.which("sinfo") else []
GPUS = ask("sinfo", "-h", "-o", "%G") if NODES else ""
needs_gpu = pytest.mark.skipif("gpu:h100" not in GPUS, reason="no Slurm with a GPU named h100 (sinfo -o %G)")
needs_slurm = pytest.mark.skipif(len(set(NODES)) < 2, reason="no Slurm of two nodes (sinfo)")


@pytest.fixture(scope="module")
def local(tmp_path_factory):
    folder = workplace(tmp_path_factory.mktemp("local"))
    (folder / "overlay.yaml").write_text(yaml.safe_dump(OVERLAY))
    snakemake(folder, "--", "data")
    return checksums(folder)


def start(folder):
    """Start the run in the queue with groups small enough for both nodes; return the process."""
    workplace(folder)
    (folder / "overlay.yaml").write_text(yaml.safe_dump(OVERLAY))
    (folder / "src/sitecustomize.py").unlink()
    command = [sys.executable, "-m", "snakemake", "--profile", "profiles/slurm", "--configfile", "overlay.yaml"]
    command += ["--cores", "1", "--slurm-status-command", "squeue", "--group-components", "clouds=50", "chunks=2", "--"]
    environment = os.environ | {"PYTHONPATH": str(folder / "src")}
    with (folder / "said.txt").open("w") as said:
        return subprocess.Popen([*command, "data"], cwd=folder, env=environment, stdout=said, stderr=subprocess.STDOUT)


def submitted(folder):
    """Slurm's job numbers by the group that was submitted."""
    text = (folder / "said.txt").read_text()
    return {number: path for number, path in re.findall(r"SLURM jobid (\d+) \(log: (\S+)/\d+\.log\)", text)}


def node_of(job):
    found = re.search(r"^\s*NodeList=(\S+)", ask("scontrol", "show", "job", job), re.MULTILINE)
    return found[1] if found else None


def watched(run, folder):
    """Wait for the run's end; node and restarts of every chunk job, asked for now: Slurm forgets jobs in minutes."""
    seen, stop = {}, time.monotonic() + 1800
    while True:
        ended = run.poll() is not None
        for job in chunk_jobs(folder):
            text = ask("scontrol", "show", "job", job)
            node = re.search(r"^\s*NodeList=(n\S+)", text, re.MULTILINE)
            if node:
                seen[job] = node[1], int(re.search(r"Restarts=(\d+)", text)[1])
        if ended:
            break
        assert time.monotonic() < stop, (folder / "said.txt").read_text()[-3000:]
        time.sleep(1)
    assert run.returncode == 0, (folder / "said.txt").read_text()[-3000:]
    return seen


def chunk_jobs(folder):
    return [job for job, path in submitted(folder).items() if "chunks" in path]


# A job named as a rule of the profile, so that the profile's own resources and groups are what is tested.
GREEDY = """
rule evaluate:
    output:
        "made.txt",
    shell:
        "echo {resources.mem_mb} >> attempts.txt; ulimit -v $(( {resources.mem_mb} * 1024 ));"
        " {config[python]} -c 'bytes(3000 << 20)' && touch {output}"
"""


def submit(folder, *arguments, snakefile=GREEDY):
    """Run a small workflow in the queue by the profile; return its exit status and its text."""
    (folder / "Snakefile").write_text(snakefile)
    command = [sys.executable, "-m", "snakemake", "--profile", ROOT / "profiles/slurm", "--workflow-profile", "none"]
    command += ["--slurm-status-command", "squeue", "--config", f"python={sys.executable}", *arguments]
    run = subprocess.run(list(map(str, command)), cwd=folder, capture_output=True, text=True)
    return run.returncode, run.stdout + run.stderr


@needs_slurm
def test_a_job_that_needs_more_memory_than_it_asked_for_gets_more_the_next_time(tmp_path):
    status, said = submit(tmp_path)
    assert status == 0, said[-3000:]
    assert (tmp_path / "attempts.txt").read_text().split() == ["2000", "4000"]


# A training and its evaluation, which the profile sends together.
ON_A_GPU = """
rule evaluate:
    input:
        "model.txt",
    output:
        "made.txt",
    shell:
        "echo $CUDA_VISIBLE_DEVICES > {output}"


rule train:
    output:
        "model.txt",
    shell:
        "echo $CUDA_VISIBLE_DEVICES > {output}; scontrol show job $SLURM_JOB_ID >> {output}"
"""


def gpu_words():
    """The command line by which the profile says that a GPU is asked for, with a GPU of the queue and less memory."""
    comment = " ".join(
        line.removeprefix("#") for line in (ROOT / "profiles/slurm/config.yaml").open() if line[0] == "#"
    )
    words = re.search(r"--set-resources ((?:\w+:\w+=\w+\s+)*\w+:\w+=\w+)", comment)[1].split()
    assert len(words) == 6
    return ["--set-resources", *words]


@needs_gpu
def test_a_training_and_its_evaluation_get_the_gpu_that_is_named(tmp_path):
    less = [word.replace("mem_mb=32000", "mem_mb=1000").replace("runtime=1440", "runtime=60") for word in gpu_words()]
    status, said = submit(tmp_path, *less, "--retries", "0", snakefile=ON_A_GPU)
    assert status == 0, said[-3000:]
    device, *asked = (tmp_path / "model.txt").read_text().splitlines()
    # Slurm names the devices of a job; without one it names none.
    assert device.isdigit() and (tmp_path / "made.txt").read_text().split() == [device]
    assert any("gres:gpu:h100:1" in line for line in asked)
    status, said = submit(
        tmp_path, *(word.replace("h100", "a100") for word in less), "--retries", "0", "--forceall", snakefile=ON_A_GPU
    )
    assert status and "invalid" in said.lower()


@pytest.fixture
def refusing(tmp_path, monkeypatch):
    """A queue that refuses every job, but notes what it was asked for; returns the lines of sbatch."""
    tools = tmp_path / "tools"
    tools.mkdir()
    for name in ("sbatch", "sinfo", "squeue", "scontrol", "sacct", "sacctmgr"):
        # The executor hangs where sinfo fails for a group of jobs.
        answer = "echo main*; exit 0" if name == "sinfo" else "exit 1"
        (tools / name).write_text(f'#!/bin/sh\necho {name} "$@" >> {tmp_path}/asked.txt\n{answer}\n')
        (tools / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{tools}:{os.environ['PATH']}")
    return lambda: [line for line in (tmp_path / "asked.txt").read_text().splitlines() if line.startswith("sbatch")]


def test_a_gpu_is_asked_for_by_name(refusing, tmp_path):
    status, _ = submit(tmp_path, *gpu_words(), "--retries", "0", snakefile=ON_A_GPU)
    (line,) = refusing()
    assert status and "--gpus=h100:1" in line and int(re.search(r"--mem (\d+)", line)[1]) >= 32000
    assert int(re.search(r"-t (\d+)", line)[1]) >= 1440


@needs_slurm
def test_two_nodes_make_the_local_bytes_in_few_jobs(local, tmp_path):
    run = start(tmp_path)
    assert {node for node, _ in watched(run, tmp_path).values()} == set(NODES)
    # Clouds, half as many as there are chunks, and what describes the data set.
    assert len(submitted(tmp_path)) <= 1 + CHUNKS // 2 + 2
    assert checksums(tmp_path) == local


@needs_slurm
def test_a_lost_node_costs_its_jobs_only(local, tmp_path):
    run = start(tmp_path)
    stop = time.monotonic() + 300
    while len({node_of(job) for job in chunk_jobs(tmp_path)} & set(NODES)) < 2:
        assert run.poll() is None and time.monotonic() < stop, (tmp_path / "said.txt").read_text()[-3000:]
        time.sleep(0.5)
    # As many as the node has cores.
    lost = set(ask("squeue", "-h", "-t", "R", "-w", NODES[-1], "-o", "%i").split()) & set(chunk_jobs(tmp_path))
    try:
        # Its jobs end, as those of a node whose power fails; it must not come back before the run has ended.
        ask("scontrol", "update", f"nodename={NODES[-1]}", "state=down", "reason=lost")
        ask("scontrol", "update", f"nodename={NODES[-1]}", "state=drain", "reason=lost")
        seen = watched(run, tmp_path)
    finally:
        ask("scontrol", "update", f"nodename={NODES[-1]}", "state=resume")
    again = {job: begun for job, (_, begun) in seen.items()}
    assert lost and again == {job: int(job in lost) for job in chunk_jobs(tmp_path)}
    assert {seen[job][0] for job in lost} == {NODES[0]}
    assert checksums(tmp_path) == local


LITTLE = ["train:runtime=20", "train:mem_mb=2000", "evaluate:runtime=20", "evaluate:mem_mb=2000"]
"""A small queue lets no job run for the profile's four hours of a training."""
