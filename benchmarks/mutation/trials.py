"""A fault set into a copy of the tree, and the tests shown to it. Copies stay, so that their machine code is kept."""

import hashlib
import math
import os
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from mutation.candidates import Mutant, mutated
from mutation.forked import Limits, run_tests


class Outcome(NamedTuple):
    """A fault and its end: `killed` or not, and how many tests were shown it.

    `late`: killed, since the tests ran out of processor time; `undecided`: neither killed nor survived, since the tests
    were stopped by the clock.
    """

    mutant: Mutant
    killed: bool
    tests: int
    late: bool = False
    undecided: bool = False


def copy_of_tree(root: Path, folder: Path) -> Path:
    """A copy of the checkout's files, with its environment linked, in which faults can be set.

    A copy that is there already gets the files that changed, and keeps its machine code. A new one gets the
    checkout's machine code.
    """
    files = subprocess.run(["git", "ls-files", "-z"], cwd=root, check=True, capture_output=True, text=True).stdout
    names = {name for name in files.split("\0") if name and (root / name).is_file()}
    compiled = [*(root / "src").rglob("*.nbi"), *(root / "src").rglob("*.nbc")] if not folder.exists() else []
    names |= {str(path.relative_to(root)) for path in compiled}
    for path in [*folder.glob("src/**/*.py"), *folder.glob("tests/**/*.py")]:
        if str(path.relative_to(folder)) not in names:
            path.unlink()
    for name in names:
        there = folder / name
        if not there.exists() or there.read_bytes() != (root / name).read_bytes():
            there.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(root / name, there)
    if not (folder / ".venv").exists():
        (folder / ".venv").symlink_to((root / ".venv").resolve())
    return folder


@contextmanager
def _fault(path: Path, text: str) -> Iterator[None]:
    """Set `text` into the file for the time of the block; its time and its kept machine code come back.

    Numba lists machine code by time and size of the source, so the fault's list would replace that of the good file.
    A new list numbers machine code from 1 again, so the fault's would also replace what the good file's list names.
    """
    source, times = path.read_text(encoding="utf-8"), path.stat()
    compiled = f"{path.stem}.*.nb[ic]"
    with tempfile.TemporaryDirectory() as aside:
        for entry in (path.parent / "__pycache__").glob(compiled):
            shutil.copy2(entry, aside)
        try:
            path.write_text(text, encoding="utf-8")
            yield
        finally:
            path.write_text(source, encoding="utf-8")
            os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
            for entry in [
                *(path.parent / "__pycache__").glob(compiled),
                *path.parent.glob(f"__pycache__/{path.stem}.*.pyc"),
            ]:
                entry.unlink()
            for entry in Path(aside).iterdir():
                shutil.copy2(entry, path.parent / "__pycache__")


def trial(tree: Path, mutant: Mutant, tests: list[str], seconds: float) -> Outcome:
    """Set a fault into `tree`, run `tests` until one fails, and take the fault out again.

    A fault that no test runs survives. `seconds`: the time that the tests take without a fault; a run that takes more
    processor time than five times that and three minutes is a loop without end, and kills. A run that takes four times
    as long as this on the clock is stopped and decides nothing: the machine may be loaded, or the tests wait.
    """
    if not tests:
        return Outcome(mutant, False, 0)
    path = tree / mutant.file
    good = hashlib.sha256(path.read_bytes()).digest()
    with _fault(path, mutated(path.read_text(encoding="utf-8"), mutant)):
        processor_s = math.ceil(180 + 5 * seconds)
        ended = run_tests(tree, tests, Limits(processor_s, 4 * processor_s), path, good)
    if ended is None:
        return Outcome(mutant, False, len(tests), undecided=True)
    # 1: a test failed; 2 to 4: its file cannot be imported; 5: all tests named were left out, which is no judgement.
    if ended == 5:
        raise RuntimeError(f"{mutant.file}:{mutant.line}: pytest ran none of {tests}")
    return Outcome(mutant, ended != 0, len(tests), late=ended == -signal.SIGXCPU)
