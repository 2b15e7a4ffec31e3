"""The command `lowalt benchmark`: data, tracks, scores of submissions, confirmed results, the table of baselines."""

import argparse
from pathlib import Path

from lowalt.commands import workflow
from lowalt.commands.command_line import Answer, add_command
from lowalt.commands.command_table import COMMANDS
from lowalt.config.command import name_backbone
from lowalt.extensions.benchmark import baseline_table, frozen_bytes
from lowalt.extensions.benchmark.baselines import kept
from lowalt.extensions.benchmark.benchmark_tracks import TRACKS, Track, named
from lowalt.extensions.benchmark.definition import MAIN, VERSION, overlays, run_name
from lowalt.files.errors import InputError
from lowalt.recognition.intervals import Interval

EXAMPLE = "lowalt benchmark score predictions.csv --track unseen"


def add_to(commands: argparse._SubParsersAction, name: str) -> None:
    """Add `benchmark` and its own commands to a parser's commands."""
    about = commands.add_parser(name, help=COMMANDS[name].meaning, epilog=f"example: {EXAMPLE}")
    own = about.add_subparsers(metavar="COMMAND", required=True)
    add_command(own, "tracks", tracks, "the tracks: whom each serves, numbers of samples", "lowalt benchmark tracks")
    line = add_command(own, "make", make, "make the data of tracks and compare them with the kept checksums",
                       "lowalt benchmark make --track unseen town")  # fmt: skip
    line.add_argument("--track", nargs="+", default=["unseen"], help="tracks whose data to make (default: unseen)")
    line.add_argument("--cores", default="all", help="cores to use (default: all)")
    line = add_command(own, "score", score, "score a submission and compare it with each baseline", EXAMPLE)
    line.add_argument("predictions", type=Path, nargs="+", help="columns key and p_CLASS (.csv); one per training seed")
    line.add_argument("--track", required=True, help="the track, such as unseen")
    line = add_command(own, "confirm", confirmed, "test a model on a set whose root seed follows from its file",
                       "lowalt benchmark confirm default-unseen --track unseen")  # fmt: skip
    line.add_argument("model", help="a .safetensors file, of a training or another, or the name of one in results/zoo")
    line.add_argument("--track", required=True, help="the track, such as unseen")
    name_backbone(line)
    line = add_command(own, "table", shown, "the table of baselines", "lowalt benchmark table --track unseen")
    line.add_argument("--track", nargs="+", default=list(TRACKS), help="tracks to show (default: all)")


def tracks(options: argparse.Namespace) -> Answer:
    """List the tracks."""
    facts = [
        {"track": track.name, "serves": track.serves, "headline": track.headline, "part": track.part,
         **{use: len(track.numbers(use)) for use in ("train", "validation", "test")}}
        for track in TRACKS.values()
    ]  # fmt: skip
    lines = ["{track:12} {train:6} train {validation:6} validate {test:6} test {serves}".format(**one) for one in facts]
    return Answer(facts, "\n".join(lines))


def make(options: argparse.Namespace) -> Answer:
    """Make the data of tracks with the workflow, and compare them with the kept checksums; status 1 where they differ.

    Raises: InputError for an unknown track.
    """
    parts = list(dict.fromkeys([MAIN, *(named(name).part for name in options.track)]))
    facts, lines = {}, []
    for part in parts:
        words = argparse.Namespace(overlay=[Path(one) for one in map(str, map(workflow.shipped, overlays(part)))],
                                   configfile=[], target=["training_samples", "signals"], cores=options.cores,
                                   dry_run=False, printshellcmds=False, profile=None, json=options.json)  # fmt: skip
        ended = workflow.ended(words)
        if ended["status"]:
            return Answer({"parts": facts}, f"{run_name(part)}: the workflow failed", ended["status"])
        facts[part] = frozen_bytes.compared(part, "results")
        count = sum(name.startswith(f"{part}/") for name in frozen_bytes.kept())
        lines += facts[part][:5] or [f"{run_name(part)}: {count} files are equal to the kept checksums"]
    return Answer({"parts": facts}, "\n".join(lines), int(any(facts.values())))


def against(name: str, lead: Interval, width: int) -> str:
    """Return a line on the difference to a method, or on a track; name: of either, padded to a width."""
    verdict = "better" if lead.low > 0 else "worse" if lead.high < 0 else "not distinguishable"
    return f"  {name:{width}}  {lead.value:+6.1f} ({lead.low:+.1f} to {lead.high:+.1f})  {verdict}"


def score(options: argparse.Namespace) -> Answer:
    """Score a submission. Raises: InputError in one sentence for a wrong track or file."""
    from lowalt.extensions.benchmark.scoring import scores
    from lowalt.extensions.benchmark.submission import read

    track = named(options.track)
    facts = scores(track, [read(path, track) for path in options.predictions], kept(track))
    return Answer(facts, _report(track, facts))


def _report(track: Track, facts: dict) -> str:
    """The scores as text."""
    counts = f"{facts['samples']} samples, training seeds: {facts['seeds']}"
    lines = [
        f"{VERSION}, track {track.name}, {counts}; percent, with 95 % intervals",
        "{} {}, macro F1 {}".format(
            facts["headline"], *map(baseline_table.words, (facts["percent"], facts["macro_f1_percent"]))
        ),
    ]
    if "rejected_percent" in facts:
        lines.append(f"rejected of the held-out class at 95 % acceptance: {facts['rejected_percent']:.1f}")
    lines.append("by SNR: " + ", ".join(f"{snr} dB {share:.1f}" for snr, share in facts["by_snr_percent"].items()))
    worst = sorted(facts["by_subtype_percent"].items(), key=lambda pair: pair[1])
    lines.append("lowest subtypes: " + ", ".join(f"{name} {share:.1f}" for name, share in worst[:5]))
    leads = sorted(facts["differences"].items(), key=lambda pair: -pair[1].value)
    lines += ["against the baselines, paired difference:"] if leads else []
    lines += [against(name, lead, 31) for name, lead in leads]
    return "\n".join(lines)


def confirmed(options: argparse.Namespace) -> Answer:
    """Confirm a model. Raises: as `lowalt.extensions.benchmark.confirm.confirm`."""
    from lowalt.extensions.benchmark.confirm import confirm

    found = confirm(options.model, named(options.track), options.backbone)
    text = (f"{VERSION} {found.track}, confirmed: {baseline_table.words(found.percent)} % of {found.samples} samples, "
            f"root seed {found.seed}, model {found.sha256}")  # fmt: skip
    return Answer(found._asdict(), text)


def shown(options: argparse.Namespace) -> Answer:
    """Show the kept table. Raises: InputError for an unknown track."""
    names = [named(name).name for name in options.track]
    rows = [row for row in baseline_table.read() if row["track"] in names]
    if not rows:
        raise InputError(f"{baseline_table.TABLE}: no row of {names}, expected a track with baselines")
    return Answer(rows, "\n".join(f"{row['track']:12} {row['method']:31} {baseline_table.result(row)}" for row in rows))
