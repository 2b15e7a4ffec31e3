"""Scheduling rounds: the faults that are mended are there, and mended rounds choose as well and cost less."""

import os
import re
import subprocess
import sys
import threading
from pathlib import Path
from types import SimpleNamespace

import pytest

from lowalt.workflow import scheduling

job_scheduler = pytest.importorskip("snakemake.scheduling.job_scheduler")
SOURCE = Path(__file__).parent.parent / "src"


class Job(SimpleNamespace):
    """A ready job as the scheduler sees it."""

    __hash__ = object.__hash__
    __eq__ = object.__eq__

    def is_group(self) -> bool:
        return False


def jobs(rule: str, count: int, priority: int = 0, first: int = 0) -> set[Job]:
    return {Job(rule=SimpleNamespace(name=rule), jobid=first + i, priority=priority) for i in range(count)}


def scheduler_of(ready: set[Job], cores: int = 2, limit: int = 100) -> SimpleNamespace:
    dag = SimpleNamespace(ready_jobs=ready)
    limiter = SimpleNamespace(max_jobs=limit)
    return SimpleNamespace(
        workflow=SimpleNamespace(dag=dag), global_resources={"_cores": cores}, job_rate_limiter=limiter
    )


def test_the_installed_snakemake_has_each_fault_or_the_cure_is_to_go():
    """Run in a process of its own, where nothing is mended yet."""
    program = (
        "from snakemake.scheduling.job_scheduler import JobScheduler as S; from lowalt.workflow import scheduling as s;"
        "before = s.faults(S); s.install(); print(sorted(before), sorted(s.faults(S)))"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == f"{sorted(scheduling.SIGNS)} []"


def test_a_version_without_the_fault_is_left_as_it_is():
    class Mended:
        def schedule(self):
            pass

    assert scheduling.faults(Mended) == set()


def test_many_rounds_leave_one_timer_and_a_new_one_follows_when_it_has_fired():
    rounds = threading.Semaphore(0)
    scheduler = SimpleNamespace(_open_jobs=rounds)
    before = threading.active_count()
    for _ in range(50):
        scheduling.one_timer(scheduler, 0.2)
    assert threading.active_count() == before + 1
    assert rounds.acquire(timeout=5) and not rounds.acquire(timeout=0.4)
    scheduling.one_timer(scheduler, 0.01)
    assert rounds.acquire(timeout=5)


@pytest.mark.parametrize(
    ("fired", "lives", "follows"), [(False, True, False), (True, True, True), (False, False, True)]
)
def test_a_timer_follows_one_that_has_fired_or_is_dead_and_ends_with_its_run(fired, lives, follows):
    old = SimpleNamespace(finished=SimpleNamespace(is_set=lambda: fired), is_alive=lambda: lives)
    scheduler = SimpleNamespace(_open_jobs=threading.Semaphore(0), _next_round=old)
    scheduling.one_timer(scheduler, 30)
    assert (scheduler._next_round is not old) == follows
    if follows:
        assert scheduler._next_round.daemon
        scheduler._next_round.cancel()


def test_jobs_in_groups_are_one_kind_whatever_their_rules():
    ready = jobs("short", 20) | jobs("long", 20, first=100)
    for job in ready:
        job.is_group = lambda: True
    assert {job.jobid for job in scheduling.selectable(scheduler_of(ready))} == set(range(8))


def test_a_round_chooses_among_the_first_jobs_of_every_rule():
    urgent, first, second = jobs("short", 3, priority=5, first=900), jobs("short", 500), jobs("long", 40, first=500)
    scheduler = scheduler_of(urgent | first | second)
    found = scheduling.selectable(scheduler)
    names = [(job.rule.name, job.jobid) for job in found]
    assert sorted(names) == sorted(
        [("short", 900), ("short", 901), ("short", 902), *(("short", i) for i in range(5))]
        + [("long", 500 + i) for i in range(8)]
    )
    # The same jobs until one has started, then the next takes its place.
    assert set(scheduling.selectable(scheduler)) == set(found)
    started = next(job for job in found if job.jobid == 0)
    scheduler.workflow.dag.ready_jobs.discard(started)
    assert {job.jobid for job in set(scheduling.selectable(scheduler)) - set(found)} == {5}


@pytest.mark.parametrize(("count", "cores", "limit"), [(0, 2, 100), (1, 2, 100), (7, 2, 100), (150, 10**9, 100)])
def test_few_ready_jobs_are_all_looked_at(count, cores, limit):
    ready = jobs("short", count)
    assert set(scheduling.selectable(scheduler_of(ready, cores, limit))) == ready


def test_a_cluster_s_round_can_start_as_many_jobs_as_its_rate_allows():
    assert len(scheduling.selectable(scheduler_of(jobs("short", 5000), cores=sys.maxsize, limit=100))) == 2 * 100
    free = scheduler_of(jobs("short", 5000), cores=7)
    assert len(scheduling.selectable(free)) == 2 * 7
    free.job_rate_limiter = None
    assert len(scheduling.selectable(free)) == 2 * 7
    free.global_resources = {}
    assert len(scheduling.selectable(free)) == scheduling.LEAST == 8


def test_unfinished_jobs_are_those_neither_finished_nor_running_nor_failed():
    every = sorted(jobs("short", 6), key=lambda job: job.jobid)
    dag = SimpleNamespace(needrun_jobs=lambda: every[1:], finished=lambda job: job is every[1])
    scheduler = SimpleNamespace(workflow=SimpleNamespace(dag=dag), running={every[2]}, failed={every[3]})
    found = scheduling.Unfinished(scheduler)
    assert list(found) == [found[0], found[1]] == every[4:] and len(found) == 2 and found


def test_a_priority_of_each_job_is_given_where_snakemake_knows_such(monkeypatch):
    from snakemake.rules import Rule

    def longest(wildcards):
        return 9

    assert scheduling.by_job(longest) is longest
    monkeypatch.delattr(Rule, "expand_priority")
    assert scheduling.by_job(longest) == 0


SNAKEFILE = """
import os
from snakemake.scheduling.job_scheduler import JobScheduler
if os.environ["MENDED"] == "yes":
    from lowalt.workflow import scheduling
    scheduling.install()
rounds, computed = [], []
choose = JobScheduler.job_selector
def counted(self, jobs):
    rounds.append(len(jobs))
    return choose(self, jobs)
JobScheduler.job_selector = counted

rule all:
    input: "last", expand("{number}", number=range(30)), expand("waits-{number}", number=range(40))
rule short:
    output: "{number,[0-9]+}"
    priority: 2
    shell: "touch {output}"
rule long:
    output: "last"
    input: expand("{number}", number=range(30))
    threads: 2
    priority: 1
    shell: "sleep 2.5; touch {output}"
rule waits:
    output: "waits-{number}"
    input: expand("{number}", number=range(30))
    threads: 2
    shell: "touch {output}"
onsuccess:
    print(f"rounds {len(rounds)} jobs {sum(rounds)}")
"""


@pytest.mark.workflow
@pytest.mark.slow
def test_mended_rounds_are_fewer_and_look_at_fewer_jobs_in_a_run_that_waits(tmp_path):
    counts = {}
    for mended in ("no", "yes"):
        folder = tmp_path / mended
        folder.mkdir()
        (folder / "Snakefile").write_text(SNAKEFILE)
        environment = {**os.environ, "PYTHONPATH": str(SOURCE), "MENDED": mended}
        command = [sys.executable, "-m", "snakemake", "--cores", "2", "--scheduler", "greedy", "--", "all"]
        run = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
        assert run.returncode == 0, run.stderr
        assert len(list(folder.glob("waits-*"))) == 40
        counts[mended] = [int(number) for number in re.search(r"rounds (\d+) jobs (\d+)", run.stdout).groups()]
    # Unmended, all 40 waiting jobs are looked at dozens of times a second while the long job runs.
    assert counts["yes"][0] < counts["no"][0] - 30
    assert counts["yes"][1] < counts["no"][1] / 3
