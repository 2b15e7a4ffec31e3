"""The launch of a training: its processes, the nodes of a cluster that share it, and its requests to the queue.

Several processes are started by torchrun. On one machine torchrun alone finds them; over several nodes
`lowalt.recognition.nodes` starts a torchrun a node by srun, inside the Slurm job of the training. The job asks for one
task a node, with the cores and GPUs of that node's processes.
"""

import os
from dataclasses import dataclass
from typing import Any

from lowalt.files.errors import InputError


@dataclass(frozen=True)
class Launch:
    """Processes that share one training, the nodes they are spread over evenly, and whether each has a GPU."""

    processes: int
    nodes: int
    gpu: bool

    @classmethod
    def of(cls, block: dict) -> "Launch":
        """Return the launch of the configuration's block `recognition`.

        Raises: InputError where the nodes cannot share the processes evenly.
        """
        launch = cls(block.get("processes", 1), block.get("nodes", 1), block.get("gpu", False))
        if launch.processes % launch.nodes:
            raise InputError(
                f"recognition.nodes: {launch.nodes} with recognition.processes: {launch.processes}, expected a number "
                "of nodes that divides the processes, of which each node gets equally many"
            )
        return launch

    @property
    def per_node(self) -> int:
        """Processes of one training on each node."""
        return self.processes // self.nodes

    @property
    def words(self) -> list[str]:
        """The words between `python -m` and the training's module; none for one process."""
        if self.nodes > 1:
            return ["lowalt.recognition.nodes", str(self.nodes), str(self.per_node)]
        if self.processes > 1:
            return ["torch.distributed.run", "--standalone", "--nproc-per-node", str(self.processes), "-m"]
        return []

    @property
    def training(self) -> dict:
        """Resources of a job that trains. `gpu` counts GPUs of one machine; a job over nodes asks for GPUs a node."""
        if self.nodes == 1:
            return {"gpu": self.processes if self.gpu else 0}
        # With `mpi` the executor leaves srun to the command, and asks for so many tasks; a number of tasks a GPU would
        # be taken from `tasks`, unless it is 0.
        tasks = {"nodes": self.nodes, "tasks": self.nodes, "mpi": "srun", "tasks_per_gpu": 0}
        return tasks | self.evaluation

    @property
    def evaluation(self) -> dict:
        """Resources of a job that predicts. It may share a training's job in the queue, so it asks in the same way."""
        if self.nodes == 1:
            return {"gpu": int(self.gpu)}
        return {"gpu": 0} | ({"gres": f"gpu:{self.per_node}"} if self.gpu else {})

    def before(self, workflow: Any) -> None:
        """Refuse a run over nodes whose jobs run on this machine, where it is no part of a Slurm job.

        workflow: Snakemake's own, before its first job. Raises: InputError.
        """
        if self.nodes > 1 and workflow.local_exec and "SLURM_JOB_ID" not in os.environ:
            raise InputError(
                f"recognition.nodes: {self.nodes}, but jobs run on this machine alone, outside Slurm; expected "
                "--workflow-profile profiles/slurm, or recognition.nodes: 1"
            )
