"""The data card: README.md, samples.csv, croissant.json and SHA256SUMS next to the index.

`python -m lowalt.shards.card` is a separate command, so that a change of wording does not re-pack
shards.
"""

import argparse
import json
import re
from collections import Counter
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

import jinja2
import yaml

from lowalt import __version__
from lowalt.config.classes import plural
from lowalt.config.command import run
from lowalt.config.network import station_names
from lowalt.files.atomic import sha256, text_of, write_file
from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import InputError
from lowalt.shards import checksums
from lowalt.shards.croissant import FIELDS, metadata
from lowalt.shards.hub import front, markdown_table
from lowalt.shards.read import ShardSet
from lowalt.shards.sample_list import slug_of
from lowalt.shards.sample_record import DATA_VERSION
from lowalt.shards.sample_table import EXTENSIONS

FROZEN = re.compile(r"lowalt-\d+-v(\d+)")
"""Name of a run that makes the data set of a benchmark, which only a new version may change."""
PAPER = "H. Luo et al., Networked ISAC Enabled Target Recognition Towards Low-Altitude Economy"
LICENSES = {
    "MIT": "https://opensource.org/license/mit",
    "CC-BY-4.0": "https://creativecommons.org/licenses/by/4.0/",
}

TEMPLATE = Path(__file__).with_name("card.md.jinja")
WHAT = {
    "image": "{stations} x {columns} tiles of time-frequency images",
    "signal": "complex symbol-domain signals",
    "cube": "all range cells of every symbol, complex, with noise",
    "recipe": "clean complex symbol-domain echoes, to which lowalt adds the noise of each sample",
}
"""Description of the data, by kind of shards."""


class Census(NamedTuple):
    """The subtypes of a data set: a record of each by its slug, and counts of samples.

    subtypes: counts by slug; snrs: counts by SNR (dB).
    """

    records: dict[str, dict]
    subtypes: Counter
    snrs: Counter


def _census(shards: ShardSet) -> Census:
    """Count the samples of a data set, and read a record of each subtype."""
    first: dict[str, int] = {}
    subtypes: Counter = Counter()
    snrs: Counter = Counter()
    start = 0
    for _, table in shards.tables():
        slugs = [slug_of(key.decode()) for key in table["key"].tolist()]
        for number, slug in enumerate(slugs, start):
            first.setdefault(slug, number)
        subtypes.update(slugs)
        snrs.update(table["snr_db"].astype(float).tolist())
        start += len(table)
    records = {slug: shards.record(number) for slug, number in sorted(first.items())}
    return Census(records, subtypes, snrs)


def _counts(shards: ShardSet) -> str:
    """Counts by group and fold, by subtype, and by SNR; sizes of the shards."""
    folds: Counter = Counter()
    for entry in shards.shards:
        folds[entry["group"], entry["fold"]] += entry["samples"]
    of_folds = [(group, fold, count) for (group, fold), count in sorted(folds.items())]
    census = _census(shards)
    of_subtypes = []
    for slug, record in census.records.items():
        names = (record["category"], record["subtype"], record["group"])
        of_subtypes.append((*names, census.subtypes[slug]))
    of_snrs = [(f"{snr:g}", count) for snr, count in sorted(census.snrs.items())]
    sizes = [entry["bytes"] / 1e6 for entry in shards.shards]
    in_all = (
        f"{len(sizes)} shards of {min(sizes):.1f} to {max(sizes):.1f} MB, "
        f"{sum(sizes) / 1e3:.3f} GB in all, "
        f"{1e3 * sum(sizes) / max(1, len(shards)):.1f} kB per sample.\n"
    )
    tables = [
        markdown_table(("subtypes", "fold", "samples"), of_folds),
        markdown_table(("category", "subtype", "group", "samples"), sorted(of_subtypes)),
        markdown_table(("SNR (dB)", "samples"), of_snrs),
    ]
    return "\n".join([*tables, in_all])


def write_samples(shards: ShardSet, path: Path) -> None:
    """Write the table of all samples (CSV, columns FIELDS), in the order of the index."""
    records = _census(shards).records

    def rows() -> Iterator[dict]:
        """One row of the table for each sample."""
        for entry, table in shards.tables():
            columns = (table[name].tolist() for name in ("key", "label", "model", "snr_db"))
            for stored_key, label, model, snr_db in zip(*columns, strict=True):
                key = stored_key.decode()
                record = records[slug_of(key)]
                # The samples of a motion model in a recipe shard share a member.
                name = key.rpartition("-")[0] if shards.kind == "recipe" else key
                yield {
                    "key": key,
                    "label": label,
                    "category": record["category"],
                    "subtype": record["subtype"],
                    "group": entry["group"],
                    "fold": entry["fold"],
                    "model": model,
                    "snr_db": f"{snr_db:g}",
                    "shard": entry["name"],
                    "file": f"{name}.{EXTENSIONS[shards.kind]}",
                }

    write_csv(path, tuple(FIELDS), rows())


def description(shards: ShardSet) -> str:
    """Return the data set in one paragraph."""
    stations = station_names(shards.index["render"]["network"])
    contents = WHAT[shards.kind].format(stations=len(stations), columns=len(shards.spectra))
    classes = ", ".join(map(plural, shards.classes))
    return (
        f"Simulated echoes of low-altitude targets ({classes}) at the base stations "
        f"{', '.join(stations)} of a networked sensing system, {len(shards)} samples as "
        f"{contents}, with motion parameters and geometry of every sample. Made by lowalt after "
        "'Networked ISAC Enabled Target Recognition Towards Low-Altitude Economy' (Luo et al.); "
        "the samples are not that paper's own."
    )


def rules(shards: ShardSet) -> str:
    """Return the version of the rules that decide the samples' bytes, as their records state it."""
    if not len(shards):
        return DATA_VERSION
    return shards.record(0)["versions"]["lowalt"]


def identity(run_name: str, shards: ShardSet) -> tuple[str, str]:
    """Return name and version of the data set of a run.

    The data set of a benchmark has the benchmark's version; any other has the version of its rules.
    """
    name = run_name if run_name.startswith("lowalt-") else f"lowalt-{run_name}"
    frozen = FROZEN.fullmatch(run_name)
    if frozen:
        return name, f"{frozen[1]}.0.0"
    return name, rules(shards)


def readme(shards: ShardSet, config: str, name: str, license_name: str) -> str:
    """Return the data card as Markdown with the metadata block that dataset hubs read.

    config: the run's YAML.
    """
    # Template blocks must not leave empty lines.
    templates = jinja2.Environment(
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        undefined=jinja2.StrictUndefined,
    )
    return templates.from_string(TEMPLATE.read_text()).render(
        front=yaml.safe_dump(front(shards, name, license_name), sort_keys=False).strip(),
        name=name,
        kind=shards.kind,
        description=description(shards),
        counts=_counts(shards),
        config=config.strip(),
        images=len(shards.columns()),
        spectra=", ".join(spectrum.upper() for spectrum in shards.spectra),
        extension=EXTENSIONS[shards.kind],
        example=shards.shards[0]["path"] if shards.shards else "SHARD.tar",
        license=license_name,
        license_address=LICENSES[license_name],
        package=__version__,
        frozen=FROZEN.fullmatch(name),
        versions=markdown_table(("rules of", "version"), [("lowalt", rules(shards))]),
    )


def write(
    index_path: str | Path, config_path: str | Path, license_name: str = "MIT", **facts: str
) -> None:
    """Write README.md, samples.csv, croissant.json and their checksums next to an index.

    facts: further properties of the Croissant description, such as `url`; `datePublished` is the
    day (UTC) on which the index was written where they name none.
    Raises: InputError where the licence is not one of LICENSES, or a file is missing or damaged.
    """
    if license_name not in LICENSES:
        raise InputError(f"--license: {license_name!r}, expected one of {sorted(LICENSES)}")
    shards = ShardSet(index_path)
    config = text_of(config_path, "configuration")
    name, version = identity(yaml.safe_load(config)["run"], shards)
    folder = Path(index_path).parent
    write_file(folder / "README.md", readme(shards, config, name, license_name))
    samples = folder / "samples.csv"
    write_samples(shards, samples)
    table = {"path": samples.name, "bytes": samples.stat().st_size, "sha256": sha256(samples)}
    written = datetime.fromtimestamp(Path(index_path).stat().st_mtime, UTC)
    known = {
        "name": name,
        "description": description(shards),
        "version": version,
        "license": LICENSES[license_name],
        "citeAs": PAPER,
        "datePublished": f"{written:%Y-%m-%d}",
        **facts,
    }
    croissant = json.dumps(metadata(shards.index, table, known), indent=1)
    write_file(folder / "croissant.json", croissant + "\n")
    checksums.write(index_path, shards.index)


def main(arguments: list[str]) -> None:
    """Write the data card, the table of samples and the Croissant description next to the index."""
    line = argparse.ArgumentParser(prog="python -m lowalt.shards.card", description=main.__doc__)
    line.add_argument("--index", required=True, help="the data set's index")
    line.add_argument(
        "--config", required=True, help="the merged configuration that made it (.yaml)"
    )
    line.add_argument(
        "--license",
        default="MIT",
        choices=sorted(LICENSES),
        help="licence of the data (default MIT)",
    )
    line.add_argument("--url", help="where the data set will be published")
    line.add_argument("--date", help="day of publication, YYYY-MM-DD (default: the index's own)")
    options = line.parse_args(arguments)
    facts = {}
    if options.url:
        facts["url"] = options.url
    if options.date:
        facts["datePublished"] = options.date
    write(options.index, options.config, options.license, **facts)


if __name__ == "__main__":
    run(main)
