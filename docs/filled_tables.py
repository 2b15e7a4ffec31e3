"""Tables of measured results in Markdown documents, written from the reference CSVs and never by
hand.

    python docs/filled_tables.py DOCUMENT NAME=FOLDER/PREFIX ...

replaces the text between `<!-- NAME -->` and `<!-- end of NAME -->`. NAME is `schemes`: accuracy of
every scheme next to the paper's, and which orderings hold; `presets`: those of `make
accuracy-cost`, their time and accuracy; or `benchmark`: the baselines of the benchmark.
"""

from pathlib import Path

from lowalt.config.command import run
from lowalt.files.atomic import existing, replacing
from lowalt.files.csv_tables import read_csv
from lowalt.files.errors import InputError
from lowalt.report.figures import cost_plots
from lowalt.report.pivots import by_scheme
from lowalt.report.sections.comparisons import ordering_words

PUBLISHED = "config/published_accuracy.csv"


def _line(cells: list[str]) -> str:
    """A row of a Markdown table."""
    return "| " + " | ".join(cells) + " |\n"


def _head(cells: list[str]) -> str:
    """The head of a Markdown table: names of columns and the line below."""
    return _line(cells) + _line(["---"] * len(cells))


def schemes(prefix: str) -> str:
    """Return the table of schemes from {prefix}accuracy.csv and {prefix}orderings.csv: averages
    over the SNRs.
    """
    rows = read_csv(
        f"{prefix}accuracy.csv", "protocol", "scheme", "snr_db", "accuracy_percent", "hardware"
    )
    ours = by_scheme(rows)
    paper = by_scheme(read_csv(PUBLISHED, "protocol", "scheme", "snr_db", "accuracy_percent"))
    text = _head(["scheme", "seen, %", "paper", "unseen, %", "paper"])
    for scheme in dict.fromkeys(row["scheme"] for row in rows):
        cells = [scheme]
        for protocol in ("seen", "unseen"):
            for source in (ours, paper):
                value = source.get(protocol, {}).get(scheme, {}).get("avg")
                cells.append("" if value is None else f"{value:.1f}")
        text += _line(cells)
    orderings = read_csv(
        f"{prefix}orderings.csv",
        "protocol",
        "scheme",
        "over",
        "difference_points",
        "low",
        "ordering",
    )
    text += "\n" + ordering_words(orderings) + "\n\n" if orderings else "\n"
    if orderings:
        names = ("claim", "protocol", "scheme", "over")
        text += _head([*names, "paper, points", "here, points", "95 % interval", "ordering"])
        for row in orderings:
            points = [
                f"{float(row[name]):+.1f}" if row[name] else ""
                for name in ("paper_points", "difference_points")
            ]
            interval = f"{float(row['low']):+.1f} to {float(row['high']):+.1f}"
            text += _line([*(row[name] for name in names), *points, interval, row["ordering"]])
    return text + f"\nMeasured on {rows[0]['hardware']}.\n"


def presets(prefix: str) -> str:
    """Return the table of presets from {prefix}accuracy_cost.csv, the quickest first; "" where it
    has none.
    """
    rows = read_csv(f"{prefix}accuracy_cost.csv", *cost_plots.RECOGNITION, *cost_plots.PRESET)
    rows = sorted((row for row in rows if row["preset"]), key=cost_plots.seconds)
    text = (
        _head(["preset", "core-seconds, data + training", "unseen, % (95 % interval)", "command"])
        if rows
        else ""
    )
    for row in rows:
        data, training, *percents = (
            float(row[name])
            for name in (
                "core_s_data",
                "core_s_training",
                "unseen_percent",
                "macro_f1_low",
                "macro_f1_high",
            )
        )
        cells = [
            f"{data:.0f} + {training:.0f}",
            "{:.1f} ({:.1f} to {:.1f})".format(*percents),
            f"`{row['command']}`",
        ]
        text += _line([row["preset"], *cells])
    return text


def benchmark(prefix: str) -> str:
    """Return the tables of the benchmark's baselines from {prefix}table.csv."""
    # The other tables need no extension.
    from lowalt.extensions.benchmark import baseline_table

    rows = baseline_table.read(prefix)
    tables = [
        _head(list(head)) + "".join(map(_line, lines))
        for head, *lines in baseline_table.tables(rows)
    ]
    return (
        "\n".join(tables)
        + f"\nMeasured on {'; and '.join(dict.fromkeys(row['hardware'] for row in rows))}.\n"
    )


MAKERS = {"schemes": schemes, "presets": presets, "benchmark": benchmark}


def fill(document: str, name: str, table: str) -> str:
    """Return the document with `table` between the marks of `name`.

    Raises: InputError where a mark is missing or stands twice.
    """
    first = f"<!-- {name} -->\n"
    last = f"<!-- end of {name} -->"
    if (
        document.count(first) != 1
        or document.count(last) != 1
        or document.index(first) > document.index(last)
    ):
        raise InputError(f"document: expected {first.strip()!r} and then {last!r}, each once")
    before, _, rest = document.partition(first)
    return before + first + table + last + rest.partition(last)[2]


def main(arguments: list[str]) -> None:
    """Fill the places of one document."""
    if len(arguments) < 2 or any(pair.partition("=")[0] not in MAKERS for pair in arguments[1:]):
        raise InputError(
            f"arguments {arguments}: expected DOCUMENT and NAME=PREFIX, names of {list(MAKERS)}"
        )
    path = existing(arguments[0], "document")
    text = path.read_text()
    for name, _, prefix in (pair.partition("=") for pair in arguments[1:]):
        text = fill(text, name, MAKERS[name](prefix))
    with replacing(Path(path)) as temporary:
        temporary.write_text(text)


if __name__ == "__main__":
    run(main)
