"""The list of survivors: a line a fault that survived a trial once, also where its room's draw is another by now."""

from pathlib import Path

from mutation.candidates import Mutant, mutated
from mutation.trials import Outcome


def changed(root: Path, mutant: Mutant) -> tuple[str, str]:
    """The line that a fault changes, before and after, without its indentation."""
    source = (root / mutant.file).read_text(encoding="utf-8")
    before, after = source.splitlines(), mutated(source, mutant).splitlines()
    place = next(i for i in range(len(before)) if i >= len(after) or before[i] != after[i])
    return before[place].strip(), after[place].strip() if place < len(after) else ""


def survivor_row(root: Path, outcome: Outcome, verdicts: dict[tuple, str]) -> dict:
    """A line of the table of survivors: where the fault stood, the line before and after, and what became of it."""
    before, after = changed(root, outcome.mutant)
    verdict = "test added" if outcome.killed else verdicts.get((outcome.mutant.file, before, after), "open")
    now = "killed" if outcome.killed else "undecided" if outcome.undecided else "survives"
    return {**outcome.mutant._asdict(), "tests": outcome.tests, "before": before, "after": after,
            "now": now, "verdict": verdict}  # fmt: skip


def earlier(root: Path, rows: list[dict[str, str]], places: list[Mutant], drawn: list[Mutant]) -> dict[Mutant, dict]:
    """Faults of kept lines that can still be set at one of the `places` and are not among those `drawn`, with the line.

    A line that moved in its file is found by its text.
    """
    found = {}
    for row in rows:
        file = root / row["file"]
        lines = file.read_text(encoding="utf-8").splitlines() if file.exists() else []
        same = [
            mutant for mutant in places
            if (mutant.file, mutant.operator) == (row["file"], row["operator"])
            and lines[mutant.line - 1].strip() == row["before"]
            and changed(root, mutant) == (row["before"], row["after"])
        ]  # fmt: skip
        found |= {mutant: row for mutant in same[:1] if mutant not in drawn}
    return found
