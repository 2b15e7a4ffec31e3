"""Snakemake runs of the tests, each a process of its own without the seconds that importing
Snakemake takes.

A helper process imports Snakemake and the libraries that its rules load, and nothing of this
package. Each run is a fork of it, with the folder, the environment and the arguments of a fresh
`python -m snakemake`.
"""

import atexit
import json
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

_HELPER = """
import gc, json, os, sys

gc.disable()
import snakemake.cli
import scipy.optimize, scipy.spatial, scipy.special, yaml, numba, jsonschema
from snakemake.scheduling import job_scheduler
from snakemake.persistence import file

assert not any(name.split(".")[0] == "lowalt" for name in sys.modules)
exec(sys.argv[1])
# Looking for garbage among all that is imported takes a fifth of a run.
gc.freeze()
gc.enable()
gc.set_threshold(100_000)
for line in sys.stdin:
    order = json.loads(line)
    child = os.fork()
    if child == 0:
        break
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
else:
    os._exit(0)

nothing, said = os.open(os.devnull, os.O_RDONLY), os.open(order["said"], os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
os.dup2(nothing, 0), os.dup2(said, 1), os.dup2(said, 2)
os.chdir(order["folder"])
os.environ.clear()
os.environ.update(order["environment"])
sys.path[:0] = [order["folder"], *filter(None, order["environment"].get("PYTHONPATH", "").split(os.pathsep))]
sys.argv = [snakemake.__file__.replace("__init__", "__main__"), *order["arguments"]]
exec(order["program"])
"""


@cache
def _helper(beforehand: str) -> subprocess.Popen:
    """The process that runs are forked from, one for each process of pytest and each program that
    it runs first.
    """
    started = subprocess.Popen(
        [sys.executable, "-E", "-c", _HELPER, beforehand],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    atexit.register(started.stdin.close)
    return started


def run(
    folder: Path,
    arguments: Sequence[str],
    environment: Mapping[str, str],
    program: str = "snakemake.cli.main()",
    beforehand: str = "",
) -> tuple[int, str]:
    """Exit status and text of `python -m snakemake ARGUMENTS` in `folder`, or of another Python
    program there.

    beforehand: program whose imports and values the runs that name it share.

    Raises RuntimeError where the helper process has ended.
    """
    with tempfile.NamedTemporaryFile("r", errors="replace") as said:
        order = {
            "folder": str(folder),
            "arguments": [*arguments],
            "environment": {**environment},
            "said": said.name,
            "program": program,
        }
        helper = _helper(beforehand)
        helper.stdin.write(json.dumps(order) + "\n")
        helper.stdin.flush()
        status = helper.stdout.readline()
        if not status:
            raise RuntimeError("the process that Snakemake's runs are forked from has ended")
        return int(status), said.read()
