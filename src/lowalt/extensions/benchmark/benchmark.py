"""The command `lowalt benchmark`: data, tracks, scores, confirmed results, table of baselines."""

import argparse
import sys
from pathlib import Path

from lowalt.commands import workflow
from lowalt.commands.command_line import Answer, add_command, add_group
from lowalt.config.command import add_backbone_option
from lowalt.extensions.benchmark import baseline_table, frozen_bytes, submitted_rows
from lowalt.extensions.benchmark.baselines import kept
from lowalt.extensions.benchmark.benchmark_tracks import TRACKS, Track, named
from lowalt.extensions.benchmark.costs import cost_of, parts_of
from lowalt.extensions.benchmark.definition import (
    RUN,
    VERSION,
    config_of,
    listed,
    overlays,
    run_name,
)
from lowalt.files.errors import InputError
from lowalt.machine.progress import announced
from lowalt.recognition.intervals import Interval

EXAMPLE = "lowalt benchmark score predictions.csv --track unseen"


def add_to(commands: argparse._SubParsersAction, name: str) -> None:
    """Add `benchmark` and its own commands to a parser's commands."""
    own = add_group(commands, name)
    add_command(
        own,
        "tracks",
        tracks,
        "the tracks: whom each serves, numbers of samples",
        "lowalt benchmark tracks",
    )
    line = add_command(
        own,
        "make",
        make,
        "make the data of tracks and compare them with the kept checksums",
        "lowalt benchmark make --track unseen clutter",
    )
    line.add_argument(
        "--track", nargs="+", default=["unseen"], help="tracks whose data to make (default: unseen)"
    )
    line.add_argument("--cores", default="all", help="cores to use (default: all)")
    line = add_command(
        own, "score", score, "score a submission and compare it with each baseline", EXAMPLE
    )
    line.add_argument(
        "predictions",
        type=Path,
        nargs="+",
        help="columns key and p_CLASS (.csv); one per training seed",
    )
    line.add_argument("--track", required=True, help="the track, such as unseen")
    line = add_command(
        own,
        "confirm",
        confirmed,
        "test a model on a set whose root seed follows from its file",
        f"lowalt benchmark confirm {RUN}-unseen --track unseen",
    )
    about = "a .safetensors file, of a training or another, or the name of one in results/zoo"
    line.add_argument("model", nargs="?", help=about)
    about = "instead of a model: a Python file that answers; it runs with your rights"
    line.add_argument("--predict", type=Path, metavar="FILE.py", help=about)
    line.add_argument("--track", required=True, help="the track, such as unseen")
    add_backbone_option(line)
    line = add_command(
        own,
        "submissions",
        rescored,
        "score every submission of a folder and write their table",
        "lowalt benchmark submissions",
    )
    line.add_argument(
        "folder",
        nargs="?",
        type=Path,
        default=Path(submitted_rows.FOLDER),
        help="folder of submissions",
    )
    line = add_command(
        own, "table", shown, "the table of baselines", "lowalt benchmark table --track unseen"
    )
    line.add_argument(
        "--track", nargs="+", default=list(TRACKS), help="tracks to show (default: all)"
    )


def tracks(options: argparse.Namespace) -> Answer:
    """List the tracks."""
    facts = []
    lines = []
    for track in TRACKS.values():
        counts = {use: len(track.numbers(use)) for use in ("train", "validation", "test")}
        about = {
            "track": track.name,
            "serves": track.serves,
            "limit": track.limit,
            "headline": track.headline,
            "part": track.part,
            **counts,
        }
        cost = cost_of([track])
        if cost is not None:
            about |= cost._asdict()
        facts.append(about)
        lines.append(
            f"{track.name:12} {counts['train']:6} train {counts['validation']:6} validate "
            f"{counts['test']:6} test {_words(track):42} {track.serves} {track.limit}".rstrip()
        )
    return Answer(facts, "\n".join(lines))


def _words(*tracks: Track) -> str:
    """The cost of the data of tracks as text."""
    cost = cost_of(list(tracks))
    if cost is None:
        return "cost not measured"
    return cost.words


def _targets(part: str, pairs: set[tuple[str, str]]) -> list[str]:
    """What the workflow makes of a part: signals, and images of some (group, fold) pairs."""
    run = run_name(part)
    views = f"results/{run}/views/{config_of(part)['recognition']['size']}"
    shards = [shard for shard in listed(part).plan.shards if tuple(shard.split("-")[:2]) in pairs]
    images = [f"{views}/{shard}.npz" for shard in shards]
    return ["signals", f"results/{run}/SHA256SUMS", f"results/{run}/config.yaml", *images]


def make(options: argparse.Namespace) -> Answer:
    """Make the data of tracks with the workflow, and compare them with the kept checksums.

    The status is 1 where they differ.
    Images are made of those groups and folds only that the tracks train, validate or test on.

    Raises: InputError for an unknown track.
    """
    asked = [named(name) for name in options.track]
    print(
        f"{' '.join(options.track)}: from empty {_words(*asked)}; what is there is kept",
        file=sys.stderr,
    )
    facts: dict[str, list[str]] = {}
    lines = []
    for part, pairs in parts_of(asked).items():
        run_options = argparse.Namespace(
            overlay=[workflow.shipped(overlay) for overlay in overlays(part)],
            configfile=[],
            target=_targets(part, pairs),
            cores=options.cores,
            dry_run=False,
            printshellcmds=False,
            profile=None,
            json=options.json,
        )
        status = workflow.ended(run_options)["status"]
        if status:
            return Answer({"parts": facts}, f"{run_name(part)}: the workflow failed", status)
        facts[part] = frozen_bytes.compared(part, "results")
        if facts[part]:
            lines += facts[part][:5]
        else:
            count = sum(name.startswith(f"{part}/") for name in frozen_bytes.kept())
            lines.append(f"{run_name(part)}: {count} files are equal to the kept checksums")
    return Answer({"parts": facts}, "\n".join(lines), int(any(facts.values())))


def against(name: str, lead: Interval, width: int) -> str:
    """Return a line on the difference to a method, or on a track.

    name: of either, padded to a width.
    """
    verdict = "not distinguishable"
    if lead.low > 0:
        verdict = "better"
    elif lead.high < 0:
        verdict = "worse"
    return f"  {name:{width}}  {lead.value:+6.1f} ({lead.low:+.1f} to {lead.high:+.1f})  {verdict}"


def score(options: argparse.Namespace) -> Answer:
    """Score a submission. Raises: InputError in one sentence for a wrong track or file."""
    from lowalt.extensions.benchmark.scoring import scores
    from lowalt.extensions.benchmark.submission import read

    track = named(options.track)
    with announced("benchmark score: reading answers and computing intervals"):
        facts = scores(track, [read(path, track) for path in options.predictions], kept(track))
    return Answer(facts, _report(track, facts))


def _report(track: Track, facts: dict) -> str:
    """The scores as text."""
    counts = f"{facts['samples']} samples, training seeds: {facts['seeds']}"
    percent = baseline_table.words(facts["percent"])
    f1 = baseline_table.words(facts["macro_f1_percent"])
    lines = [
        f"{VERSION}, track {track.name}, {counts}; percent, with 95 % intervals",
        f"{facts['headline']} {percent}, macro F1 {f1}",
    ]
    if "others_percent" in facts:
        hardest = " and ".join(baseline_table.HARDEST)
        lines.append(
            f"median over subtypes {facts['median_percent']:.1f}, without {hardest} "
            f"{facts['others_percent']:.1f}"
        )
    if "rejected_percent" in facts:
        lines.append(
            f"rejected of the held-out class at 95 % acceptance: {facts['rejected_percent']:.1f}"
        )
    by_snr = [f"{snr} dB {share:.1f}" for snr, share in facts["by_snr_percent"].items()]
    lines.append("by SNR: " + ", ".join(by_snr))
    if track.limit:
        lines.append(track.limit)
    worst = sorted(facts["by_subtype_percent"].items(), key=lambda pair: pair[1])
    lowest = [f"{name} {share:.1f}" for name, share in worst[:5]]
    lines.append("lowest subtypes: " + ", ".join(lowest))
    leads = sorted(facts["differences"].items(), key=lambda pair: -pair[1].value)
    if leads:
        lines.append("against the baselines, paired difference:")
    lines += [against(name, lead, 31) for name, lead in leads]
    return "\n".join(lines)


def confirmed(options: argparse.Namespace) -> Answer:
    """Confirm a model, or a file that answers.

    Raises: as the functions of `lowalt.extensions.benchmark.confirm`.
    """
    from lowalt.extensions.benchmark.confirm import confirm, confirm_predictions

    track = named(options.track)
    if (options.model is None) == (options.predict is None):
        raise InputError("benchmark confirm: expected either a model or --predict FILE.py")
    if options.predict:
        print(
            f"{options.predict} runs in this process, with your rights and at your own risk",
            file=sys.stderr,
        )
        found = confirm_predictions(options.predict, track)
    else:
        found = confirm(options.model, track, options.backbone)
    text = (
        f"{VERSION} {found.track}, confirmed: {baseline_table.words(found.percent)} % of "
        f"{found.samples} samples, root seed {found.seed}, SHA-256 {found.sha256}"
    )
    return Answer(found._asdict(), text)


def rescored(options: argparse.Namespace) -> Answer:
    """Score all submissions of a folder and write its table.

    Raises: InputError naming what is wrong with one.
    """
    if not options.folder.is_dir():
        raise InputError(f"{options.folder}: no such folder of submissions")
    with announced("benchmark submissions: scoring"):
        rows = list(submitted_rows.rows(options.folder))
    path = submitted_rows.write(options.folder, rows)
    line = "{submission:24} {track:12} {percent} ({low} to {high})"
    lines = [line.format(**row) for row in rows]
    return Answer(rows, "\n".join([*lines, f"{path}: {len(rows)} rows"]))


def shown(options: argparse.Namespace) -> Answer:
    """Show the kept table. Raises: InputError for an unknown track."""
    names = [named(name).name for name in options.track]
    rows = [row for row in baseline_table.read() if row["track"] in names]
    if not rows:
        raise InputError(
            f"{baseline_table.TABLE}: no row of {names}, expected a track with baselines"
        )
    lines = []
    for row in rows:
        lines.append(f"{row['track']:12} {row['method']:31} {baseline_table.result(row)}")
    return Answer(rows, "\n".join(lines))
