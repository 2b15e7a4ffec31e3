"""The explanation of a scene as text for people: a verdict, one table of effects, and levels."""

import importlib
import math
from collections.abc import Sequence

import yaml

from lowalt.scene.catalogue import dotted
from lowalt.scene.explain import Change, Finding
from lowalt.scene.levels import table

FOUND = 0.9
"""Share of symbols from which a target counts as found."""


def verdict(findings: Sequence[Finding]) -> list[str]:
    """Return sentences that say whether the receiver finds its targets, and what would find more of them."""
    share = _mean([finding.right for finding in findings])
    classes = list(dict.fromkeys(finding.category for finding in findings))
    of_class = {name: [finding for finding in findings if finding.category == name] for name in classes}
    shares = ", ".join(f"{name} {_mean([each.right for each in mine]):.0%}" for name, mine in of_class.items())
    lines = [f"The target's range cell, or one next to it, is chosen in {share:.0%} of the symbols: {shares}."]
    levels = {name: _mean([each.over_db for each in mine]) for name, mine in of_class.items()}
    if any(math.isfinite(level) for level in levels.values()):
        said = (f"{name} {abs(level):.1f} dB {'above' if level >= 0 else 'below'}" for name, level in levels.items())
        lines.append(f"Behind the filters the target is, against the loudest cell of all else: {', '.join(said)} it.")
    better = {name: _mean([each.otherwise[name] for each in findings]) for name in findings[0].otherwise}
    best = max(better, key=better.__getitem__)
    if share < FOUND and better[best] > share + 0.05:
        lines.append(f"With {best} it would be {better[best]:.0%}.")
    return lines


def _mean(values: Sequence[float]) -> float:
    """Mean of some numbers."""
    return sum(values) / len(values)


def effects_table(changes: Sequence[Change], sources: bool) -> list[str]:
    """Return one line an effect: what the signal, the cells and the images lose or gain with it, and its time."""
    more = list(dict.fromkeys(key for change in changes for key in change.more))
    columns = "".join(f"{key:>9}" for key in more)
    lines = [f"{'effect':<20} {'':<7} {'signal':>8} {'cells':>7} {columns}{'ms':>9}"]
    for change in changes:
        head = f"{change.effect:<20} {'named' if change.named else 'added':<7} "
        if change.refused:
            lines.append(f"{head}not tried: {change.refused}")
            continue
        shares = "".join(f"{change.more.get(key, math.nan):>9.1%}" for key in more)
        cells = f"{change.signal:>8.1%} {change.cells:>7.1%} {shares}{change.ms:>9.1f}"
        lines.append(f"{head}{cells}  {change.also}".rstrip())
    lines.append(
        "named: without it; added: with it and its defaults. Shares of the signal's rms, of symbols, of pixels."
    )
    if sources:
        lines += [f"{change.effect}: {importlib.import_module(dotted(change.effect)).SOURCE}" for change in changes]
    return lines


def suggested(overlay: dict, changes: Sequence[Change], least: float) -> str:
    """Return a scene as YAML with those of its effects that change a signal by more than `least`, each with its share.

    overlay: the scene's own blocks.
    """
    rest = {key: value for key, value in overlay.items() if key != "effects"}
    lines = [yaml.safe_dump(rest, sort_keys=False).rstrip()] if rest else []
    kept = [change for change in changes if change.named and not change.signal <= least]
    lines.append(f"# Effects that change a signal by more than {least:g} of its root mean square, and by how much.")
    lines.append("effects:" if kept else "effects: {}")
    for change in kept:
        block = yaml.safe_dump(overlay["effects"][change.effect] or {}, default_flow_style=True, width=1000)
        lines.append(f"  {change.effect}: {block.strip()}  # {change.signal:.2g}")
    return "\n".join(lines) + "\n"


def level_lines(finding: Finding) -> list[str]:
    """Return the levels of one sample at one station as a link budget lists them."""
    head = f"{finding.subtype}, model {finding.model}, station {finding.station}, range {finding.range_m:.0f} m"
    return [head, *(f"  {line}" for line in table(finding.levels))]
