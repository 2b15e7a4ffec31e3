"""How often a queue is asked for the state of jobs: often while jobs are young, so that short ones cost no waiting.

The executor for Slurm, up to version 2.8 at least, waits 10 s longer after each question that found no job ended, up to
180 s: it asks after 5, 20, 45, 80 s and so on, so it notices the end of a job of 46 s after another 34 s. `install`
puts another rule in its place, where the installed version has that one: each wait is a fifth longer than the last,
30 s at most. A job that ends after T seconds is then noticed within T/5 plus the first wait, which the profile sets,
and within 30 s.
"""

import inspect
import sys

PLUGIN = "snakemake_executor_plugin_slurm"
SIGN = "self.next_seconds_between_status_checks + 10"
"""Part of the plugin's source that shows its own rule."""
GROWTH, MOST_S = 1.2, 30.0


def waits_too_long(executor: type) -> bool:
    """Return whether the source of an executor class has the plugin's own rule."""
    method = inspect.getattr_static(executor, "check_active_jobs", None)
    return method is not None and SIGN in inspect.getsource(method)


def install() -> None:
    """Replace the rule for this process, once; without the plugin nothing happens."""
    plugin = sys.modules.get(PLUGIN)
    if plugin is None or not waits_too_long(plugin.Executor):
        return
    before = plugin.Executor.next_seconds_between_status_checks
    if before.fset is not _slower:
        plugin.Executor.next_seconds_between_status_checks = property(before.fget, _slower)


def _slower(executor: object, asked_s: float | None) -> None:
    """Set the seconds until the next question; the plugin asks for more than the last wait where no job has ended."""
    last_s = executor._next_seconds_between_status_checks
    grown = last_s is not None and asked_s is not None and asked_s > last_s
    executor._next_seconds_between_status_checks = min(GROWTH * last_s, max(MOST_S, last_s)) if grown else asked_s
