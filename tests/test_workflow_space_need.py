"""What a run needs at the limits: what just fits is no fault, and jobs run together as far as the cores reach."""

from lowalt.workflow import space
from test_workflow_space import CONFIG, PLAN


def test_a_verdict_changes_where_more_is_needed_than_there_is_and_not_before():
    """Exactly what is free suffices; a disk warns beyond nine tenths; a refused job is not warned about as well."""

    def told(disk=0.0, largest=0.0, memory=0.0):
        found = space.Need(disk, largest, "train", memory, 1, ())
        return [[text.split(",")[0] for text in part] for part in space.verdicts(found, 10e9, 2e9, 4e9)]

    assert told(disk=9e9) == told(largest=4e9) == told(memory=2e9) == [[], []]
    assert told(disk=10e9) == [[], ["the run will write 10.0 GB"]] and told(disk=9.01e9)[1]
    assert told(disk=10.01e9) == [["the run will write 10.0 GB"], []]
    assert told(largest=4.01e9, memory=9e9) == [["a job of the rule train will need 4.0 GB of memory"], []]
    assert told(memory=2.01e9) == [[], ["jobs that run at the same time may need 2.0 GB of memory"]]
    assert [space._size(size) for size in (1e9, 999_949_000.0, 0.0)] == ["1.0 GB", "999.9 MB", "0.0 MB"]


def test_the_largest_jobs_that_fit_the_cores_run_together():
    """Three jobs of two threads on five cores: the two largest, and a small one of a thread."""
    figures = {name: space.Figures(0.0, 0.0, size, 0.0, False) for name, size in
               (("a", 5.0), ("b", 7.0), ("c", 6.0), ("d", 1.0), ("e", 0.5))}  # fmt: skip
    jobs = [space.PlannedJob(name, {}, threads=threads) for name, threads in zip("abcde", (2, 2, 2, 1, 1), strict=True)]
    found = space.need(jobs, figures, PLAN, CONFIG, 5)
    assert (found.memory, found.largest_job, found.largest_rule) == (14.0, 7.0, "b")
    assert space.need([], figures, PLAN, CONFIG, 5) == space.Need(0.0, 0.0, "", 0.0, 0, ())


def test_temporary_files_count_as_the_two_largest_a_core():
    figures = {name: space.Figures(size, 0.0, 0.0, 0.0, True) for name, size in (("a", 5.0), ("b", 7.0), ("c", 6.0))}
    jobs = [space.PlannedJob(name, {}) for name in "abcab"]
    assert [space.need(jobs, figures, PLAN, CONFIG, cores).disk for cores in (1, 2, 3)] == [14.0, 25.0, 30.0]
