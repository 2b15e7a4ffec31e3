"""The environment of a run's jobs: interpreter, source, and folder of the user's inputs."""

import os
import sys
from pathlib import Path

INPUTS = "LOWALT_INPUTS"


def prepare(source: Path, inputs: str | None) -> str | None:
    """Set the environment of jobs and return the folder of the user's inputs.

    It is `inputs`, else LOWALT_INPUTS, else None.
    Jobs run `python -m lowalt.STAGE` with the interpreter of the workflow, even if its environment
    is not active. They use the source of this checkout, also in an environment of their own (conda,
    a cluster node).
    """
    environment = os.environ
    environment["PATH"] = os.pathsep.join(
        [str(Path(sys.executable).parent), environment.get("PATH", "")]
    )
    # Files of the project are UTF-8 whatever the locale says.
    environment["PYTHONUTF8"] = "1"
    paths = [str(source)]
    if environment.get("PYTHONPATH"):
        paths.insert(0, environment["PYTHONPATH"])
    environment["PYTHONPATH"] = os.pathsep.join(paths)
    folder = inputs or environment.get(INPUTS) or None
    if folder:
        environment[INPUTS] = str(folder)
    return folder
