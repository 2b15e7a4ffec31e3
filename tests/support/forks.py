"""Programs that begin without this package, each in a process of its own, at a fraction of the time
of fresh ones.

A helper process imports the libraries that take long and nothing of this package. Each program is a
fork of it.
"""

import json
import subprocess
import sys
from collections.abc import Sequence

LIBRARIES = (
    "numpy",
    "numba",
    "scipy.optimize",
    "scipy.spatial",
    "scipy.special",
    "yaml",
    "jsonschema",
)
_HELPER = """
import gc, importlib, json, os, sys, tempfile, traceback

gc.disable()
libraries, programs = json.loads(sys.argv[1])
for name in libraries:
    importlib.import_module(name)
assert not any(name.split(".")[0] == "lowalt" for name in sys.modules)
# Looking for garbage among all that is imported takes a tenth of its time.
gc.freeze()
gc.enable()
ended = []
for program in programs:
    with tempfile.TemporaryFile("w+") as said, tempfile.TemporaryFile("w+") as complained:
        child = os.fork()
        if child == 0:
            status = 0
            os.dup2(said.fileno(), 1), os.dup2(complained.fileno(), 2)
            try:
                exec(compile(program, "<program>", "exec"), {"__name__": "__main__"})
            except SystemExit as end:
                status = end.code or 0
            except BaseException:
                traceback.print_exc()
                status = 1
            sys.stdout.flush(), sys.stderr.flush()
            os._exit(status)
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        said.seek(0), complained.seek(0)
        ended.append([status, said.read(), complained.read()])
print(json.dumps(ended))
"""


def ended(programs: Sequence[str], *libraries: str) -> list[tuple[int, str, str]]:
    """Run each program; return its exit status and what it printed to both streams. libraries:
    imported beforehand.
    """
    call = [sys.executable, "-c", _HELPER, json.dumps([[*LIBRARIES, *libraries], programs])]
    run = subprocess.run(call, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return [tuple(found) for found in json.loads(run.stdout)]


def printed(programs: Sequence[str]) -> list[str]:
    """Run each program; return what it printed. Fails where one ends with an error."""
    found = ended(programs)
    assert not any(status for status, _, _ in found), found
    return [text for _, text, _ in found]
