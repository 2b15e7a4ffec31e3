"""Skipped tests are counted by reason, and `--strict-skips` fails a run that skips for a reason not
listed here.

A package that is missing is no such reason: the set-up of `make test` installs every extra that a
test asks for.
"""

import re
from collections import Counter

import pytest

EXPECTED = (
    "mounting a file system needs root",
    "no Slurm of two nodes",
    "zipfile wrote other headers before",
    r"no [\w-]+ here",
    "no bash",
    "no Chromium on this machine",
    "no real inputs",
    "not a git checkout",
)
"""Beginnings of reasons that the machine gives: it cannot do a thing, or lacks it."""


class Skips:
    """Counts the skipped tests of a run; pytest calls its methods."""

    def __init__(self) -> None:
        self.reasons: Counter = Counter()

    def _count(self, report) -> None:
        """Count a report's reason, if it tells of a skip."""
        if report.skipped and isinstance(report.longrepr, tuple):
            self.reasons[report.longrepr[2].removeprefix("Skipped: ")] += 1

    def pytest_runtest_logreport(self, report):
        """A test was skipped."""
        self._count(report)

    def pytest_collectreport(self, report):
        """A whole file of tests was skipped."""
        self._count(report)

    def unexpected(self) -> dict[str, int]:
        """Reasons that are not listed, with their numbers of tests."""
        return {
            reason: n
            for reason, n in self.reasons.items()
            if not any(re.match(e, reason) for e in EXPECTED)
        }

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session):
        """A run that passed fails where a skip is not expected."""
        if (
            self.unexpected()
            and session.config.getoption("strict_skips")
            and not session.exitstatus
        ):
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter):
        """Say how often each reason was given."""
        for reason, count in self.reasons.most_common():
            word = "UNEXPECTED SKIP" if reason in self.unexpected() else "skipped"
            terminalreporter.write_line(f"{word}: {count} x {reason}")
