"""Which processes live, and whose unfinished files are removed."""

import os
import subprocess
import time

import pytest

from lowalt.files.atomic import replacing
from lowalt.files.processes import lives, state


@pytest.fixture
def ended():
    """The id of a process that was killed and whose parent has not asked for its status yet."""
    child = subprocess.Popen(["sleep", "60"])
    child.kill()
    while state(child.pid) != "Z":
        time.sleep(0.001)
    yield child.pid
    child.wait()


def test_a_process_that_was_killed_does_not_live_though_its_id_is_kept(ended):
    os.kill(ended, 0)
    assert not lives(ended) and lives(os.getpid()) and lives(1)
    assert not lives(2**40)


def test_what_a_killed_process_left_of_a_file_is_removed_at_once_and_what_a_living_one_writes_is_not(
    tmp_path, ended
):
    left, written, other = (
        tmp_path / name
        for name in (f".table.{ended}.part.csv", ".table.1.part.csv", f".tables.{ended}.part.csv")
    )
    for path in (left, written, other):
        path.write_text("half")
    with replacing(tmp_path / "table.csv") as temporary:
        temporary.write_text("whole")
    assert set(tmp_path.iterdir()) == {tmp_path / "table.csv", written, other}
