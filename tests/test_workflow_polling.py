"""How often Slurm is asked: the rule that is replaced is there, and the new one notices an end soon after it."""

import subprocess
import sys
from itertools import pairwise

import pytest

from lowalt.workflow import polling

plugin = pytest.importorskip("snakemake_executor_plugin_slurm")
FIRST_S = 3.0


def asked(executor: type, seconds: float) -> list[float]:
    """Times at which an executor asks for the state of a job that ends after so many seconds, as the plugin asks."""
    one = object.__new__(executor)
    one._next_seconds_between_status_checks = None
    one.next_seconds_between_status_checks = FIRST_S
    times = [0.0]
    while times[-1] < seconds:
        times.append(times[-1] + one.next_seconds_between_status_checks)
        one.next_seconds_between_status_checks = min(one.next_seconds_between_status_checks + 10, 180)
    # A job has ended: the plugin goes back to the first wait.
    one.next_seconds_between_status_checks = FIRST_S
    assert one.next_seconds_between_status_checks == FIRST_S
    return times


@pytest.fixture
def mended(monkeypatch):
    """A class like the plugin's with the new rule; the plugin's own stays as it is."""
    executor = type("Executor", (plugin.Executor,), {})
    monkeypatch.setattr(plugin, "Executor", executor)
    polling.install()
    return executor


def test_the_installed_plugin_waits_too_long_or_the_cure_is_to_go():
    assert polling.waits_too_long(plugin.Executor)
    assert asked(plugin.Executor, 40)[-1] - 40 > 30


@pytest.mark.parametrize("seconds", [2, 10, 46, 130, 600, 7200])
def test_an_end_is_noticed_after_a_fifth_of_the_time_and_the_first_wait_at_most(mended, seconds):
    times = asked(mended, seconds)
    assert times[-1] - seconds <= min(seconds / 5 + FIRST_S, 30)
    # An administrator minds questions: a day has fewer than three thousand.
    assert len(times) <= 18 + seconds / 30


def test_each_wait_is_a_fifth_longer_than_the_last_up_to_half_a_minute(mended):
    waits = [later - now for now, later in pairwise(asked(mended, 300))]
    assert waits == pytest.approx([min(3 * 1.2**number, 30) for number in range(len(waits))], rel=1e-9)


def test_a_wait_that_is_asked_for_again_stays_as_it_is(mended):
    one = object.__new__(mended)
    one._next_seconds_between_status_checks = 20.0
    one.next_seconds_between_status_checks = 20.0
    assert one.next_seconds_between_status_checks == 20.0


def test_a_profile_that_asks_rarely_is_not_asked_more_often(mended):
    one = object.__new__(mended)
    one._next_seconds_between_status_checks = 60.0
    one.next_seconds_between_status_checks = 70.0
    assert one.next_seconds_between_status_checks == 60.0


def test_a_second_install_changes_nothing(mended):
    found = mended.next_seconds_between_status_checks
    polling.install()
    assert mended.next_seconds_between_status_checks is found


def test_another_rule_or_no_plugin_is_left_alone(monkeypatch):
    class Other:
        def check_active_jobs(self):
            """Another rule."""

    assert not polling.waits_too_long(Other) and not polling.waits_too_long(object)
    program = "import sys; from lowalt.workflow import polling as p; p.install(); print(p.PLUGIN in sys.modules)"
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "False"
