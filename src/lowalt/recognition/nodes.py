"""Processes of one training on several nodes of a Slurm cluster, started from inside the training's Slurm job.

    python -m lowalt.recognition.nodes NODES COUNT MODULE [ARGUMENT ...]

runs MODULE in NODES times COUNT processes: srun starts one task a node, and torchrun in each task COUNT processes. They
find each other through a store that this process keeps, at a port that is free.
Ranks compute the same whichever node they are on, so nodes of one kind train to the bytes of one machine.
"""

import os
import shutil
import signal
import socket
import subprocess
import sys

from lowalt.config.command import exit_status
from lowalt.files.errors import InputError

NAMED = ["sh", "-c", 'export PET_LOCAL_ADDR="$(hostname)"; exec "$@"', "sh"]
"""Before a task's command: torchrun's own idea of its node's name is "localhost" where /etc/hosts lists that first."""


def command(nodes: int, count: int, endpoint: str, job: str, module: list[str]) -> list[str]:
    """Return the command that runs a module, with its arguments, in `count` processes on each of `nodes` nodes.

    endpoint: HOST:PORT of the store; job: Slurm's number of the job. Each task gets the cores of this process's job,
    which Snakemake writes into OMP_NUM_THREADS.
    """
    cores = os.environ.get("OMP_NUM_THREADS", "1")
    # Another step of the job, such as the one this process may run in, keeps no core from these tasks.
    step = ["srun", f"--nodes={nodes}", f"--ntasks={nodes}", "--ntasks-per-node=1", f"--cpus-per-task={cores}"]
    step += ["--overlap", "--kill-on-bad-exit=1", "--export=ALL", "--input=none"]
    torchrun = ["-m", "torch.distributed.run", f"--nnodes={nodes}", f"--nproc-per-node={count}", "--rdzv-backend=c10d"]
    torchrun += [f"--rdzv-endpoint={endpoint}", f"--rdzv-id={job}", "--rdzv-conf=is_host=0", "-m", *module]
    return [*step, *NAMED, sys.executable, *torchrun]


def main(arguments: list[str]) -> None:
    """Run a module on several nodes: NODES COUNT MODULE [ARGUMENT ...].

    Raises: InputError outside Slurm; SystemExit with the status of srun where that is not 0.
    """
    if len(arguments) < 3:
        raise InputError(f"arguments {arguments}, expected NODES COUNT MODULE")
    nodes, count, *module = arguments
    job = os.environ.get("SLURM_JOB_ID")
    if not job or not shutil.which("srun"):
        lacking = "srun is not installed" if job else "SLURM_JOB_ID is not set"
        raise InputError(
            f"recognition.nodes: no Slurm job here ({lacking}), expected one: --workflow-profile profiles/slurm, "
            "or recognition.nodes: 1"
        )
    # Only here, so that a refusal does not wait for torch.
    from torch.distributed import TCPStore

    host = socket.gethostname()
    store = TCPStore(host, 0, is_master=True, wait_for_workers=False)
    tasks = subprocess.Popen(command(int(nodes), int(count), f"{host}:{store.port}", job, module))
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, _: tasks.send_signal(number))
    status = tasks.wait()
    if status:
        print(
            f"training over {nodes} nodes: srun ended with status {status}; has the Slurm job {job} so many nodes, "
            "and do all see this folder?", file=sys.stderr,
        )  # fmt: skip
        raise SystemExit(exit_status(status))


if __name__ == "__main__":
    from lowalt.config.command import run

    run(main)
