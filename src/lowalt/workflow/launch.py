"""How a training is launched: its number of processes, the cluster nodes they run on, and what its job requests.

One process needs no launcher, and several on one machine are started by torchrun. Over several nodes,
`lowalt.recognition.nodes` starts one torchrun per node by srun, inside the training's Slurm job. That job requests one
task per node, with the cores and GPUs of all processes on that node.
"""

import os
from dataclasses import dataclass
from typing import Any

from lowalt.files.errors import InputError


@dataclass(frozen=True)
class Launch:
    """Number of processes that share one training, number of nodes (each runs equally many), whether each has a GPU."""

    processes: int
    nodes: int
    gpu: bool

    @classmethod
    def of(cls, block: dict) -> "Launch":
        """Read the launch from the configuration's block `recognition`.

        Raises: InputError where the number of nodes does not divide the number of processes.
        """
        launch = cls(block.get("processes", 1), block.get("nodes", 1), block.get("gpu", False))
        if launch.processes % launch.nodes:
            raise InputError(
                f"recognition.nodes: {launch.nodes} with recognition.processes: {launch.processes}, expected a number "
                "of nodes that divides the number of processes"
            )
        return launch

    @property
    def per_node(self) -> int:
        """Number of processes of one training on each node."""
        return self.processes // self.nodes

    @property
    def words(self) -> list[str]:
        """Command-line words between `python -m` and the training's module; empty for a single process."""
        if self.nodes > 1:
            return ["lowalt.recognition.nodes", str(self.nodes), str(self.per_node)]
        if self.processes > 1:
            return ["torch.distributed.run", "--standalone", "--nproc-per-node", str(self.processes), "-m"]
        return []

    @property
    def training(self) -> dict:
        """Snakemake resources of a training job: `gpu` on one machine, `gres` (GPUs per node) over several nodes."""
        if self.nodes == 1:
            return {"gpu": self.processes if self.gpu else 0}
        # With `mpi`, the executor requests `tasks` tasks and the command itself calls srun. Without `tasks_per_gpu: 0`,
        # the executor would also request `tasks` tasks per GPU.
        tasks = {"nodes": self.nodes, "tasks": self.nodes, "mpi": "srun", "tasks_per_gpu": 0}
        return tasks | self.evaluation

    @property
    def evaluation(self) -> dict:
        """Snakemake resources of a prediction job, with the keys of `training`, as both may share one Slurm job."""
        if self.nodes == 1:
            return {"gpu": int(self.gpu)}
        return {"gpu": 0} | ({"gres": f"gpu:{self.per_node}"} if self.gpu else {})

    def before(self, workflow: Any) -> None:
        """Refuse a training over several nodes whose jobs would run on this machine, outside any Slurm job.

        workflow: Snakemake's workflow object, before its first job. Raises: InputError.
        """
        if self.nodes > 1 and workflow.local_exec and "SLURM_JOB_ID" not in os.environ:
            raise InputError(
                f"recognition.nodes: {self.nodes}, but jobs run on this machine, outside Slurm; expected "
                "--workflow-profile profiles/slurm, or recognition.nodes: 1"
            )
