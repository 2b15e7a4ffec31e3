"""Processes of one training on several nodes of a Slurm cluster, started from inside the training's Slurm job.

    python -m lowalt.recognition.nodes NODES COUNT MODULE [ARGUMENT ...]

runs MODULE in NODES x COUNT processes: srun starts one task per node, and torchrun starts COUNT processes in each task.
The processes find each other through a store, which this process keeps open at a free port.
A rank computes the same on every node. Training on nodes of one kind therefore gives the same bytes as on one machine.
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
"""Prefix of a task's command that tells torchrun the node's name.

Without it torchrun calls its node "localhost" where /etc/hosts lists that name first."""


def command(nodes: int, count: int, endpoint: str, job: str, module: list[str]) -> list[str]:
    """Return the command that runs a module, with its arguments, in `count` processes on each of `nodes` nodes.

    endpoint: HOST:PORT of the store; job: the Slurm job's number. Each task gets as many cores as this process's job,
    a number that Snakemake writes into OMP_NUM_THREADS.
    """
    cores = os.environ.get("OMP_NUM_THREADS", "1")
    # --overlap: share cores with the job step that this process may run in.
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
    # Imported late, so that a refusal does not wait for torch.
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
            "and do all see this folder?",
            file=sys.stderr,
        )
        raise SystemExit(exit_status(status))


if __name__ == "__main__":
    from lowalt.config.command import run

    run(main)
