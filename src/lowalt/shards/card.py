"""The data card: README.md, samples.csv, croissant.json and SHA256SUMS next to the index: the folder can be published.

A command of its own, `python -m lowalt.shards.card`, so that a change of wording packs no shard again.
"""

import argparse
import json
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import yaml

from lowalt import __version__
from lowalt.config.classes import plural
from lowalt.config.command import run
from lowalt.config.network import station_names
from lowalt.files.atomic import replacing, sha256, text_of
from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import InputError
from lowalt.shards import checksums
from lowalt.shards.card_kinds import READING, WHAT
from lowalt.shards.croissant import FIELDS, metadata
from lowalt.shards.hub import front
from lowalt.shards.read import ShardSet
from lowalt.shards.sample_table import EXTENSIONS

SLUG = re.compile(r"(.+)-\d{6}-snr")
PAPER = "H. Luo et al., Networked ISAC Enabled Target Recognition Towards Low-Altitude Economy"
LICENSES = {"MIT": "https://opensource.org/license/mit", "CC-BY-4.0": "https://creativecommons.org/licenses/by/4.0/"}

ODDITIES = """\
- Doppler folds at half the symbol rate by design: rotors, cars and most UAVs alias, as in the published setting.
- At every range-cell crossing the signal jumps in phase by nearly pi: the stripes of fast cars are real.
- Published wheel diameters are rim sizes, so wheels turn faster than real ones; runners move at walking speed; bird
  sizes are small. They are followed as published.
- Six SNRs of one motion model are nearly the same picture: split by motion model, as the folds here do, unless
  `split.by` is `sample` (the published way, which leaks motions from training into test).
- Each image is scaled by its own largest value: absolute echo strength, and with it range, is not in the images. It is
  in the signals.
"""

LIMITS = """\
- Simulated: scattering points in free space with equal or modelled cross sections; no clutter, no multipath, no
  occlusion, no receiver impairments unless the configuration below names them as effects.
- Built-in targets are parametric models with published sizes and rates, not measured craft, animals or people.
- One target a sample, tracked perfectly: the strongest range cell of every symbol is the target's.
"""


def _table(header: tuple[str, ...], rows: list[tuple]) -> str:
    """Return a Markdown table."""
    lines = [header, tuple("---" for _ in header), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines) + "\n"


def _slug(key: str) -> str:
    """The subtype's file name at the start of a sample's key, {subtype}-{model, six digits}-{SNR}.

    Raises: InputError naming a key of another form.
    """
    parts = SLUG.match(key)
    if parts is None:
        raise InputError(f"sample key {key!r}: expected SUBTYPE-MODEL-snrSNR")
    return parts[1]


def _census(shards: ShardSet) -> tuple[dict[str, dict], Counter, Counter]:
    """Return a record of each subtype by its slug, and the counts of samples by slug and by SNR (dB)."""
    first: dict[str, int] = {}
    subtypes: Counter = Counter()
    snrs: Counter = Counter()
    start = 0
    for _, table in shards.tables():
        slugs = [_slug(key.decode()) for key in table["key"].tolist()]
        for place, slug in enumerate(slugs, start):
            first.setdefault(slug, place)
        subtypes.update(slugs)
        snrs.update(table["snr_db"].astype(float).tolist())
        start += len(table)
    return {slug: shards.record(place) for slug, place in sorted(first.items())}, subtypes, snrs


def _counts(shards: ShardSet) -> str:
    """Counts by group and fold, by subtype, and by SNR; sizes of the shards."""
    places: Counter = Counter()
    for entry in shards.shards:
        places[entry["group"], entry["fold"]] += entry["samples"]
    parts = [_table(("subtypes", "fold", "samples"), [(*place, number) for place, number in sorted(places.items())])]
    records, counts, snrs = _census(shards)
    rows = [(record["category"], record["subtype"], record["group"], counts[slug]) for slug, record in records.items()]
    parts.append(_table(("category", "subtype", "group", "samples"), sorted(rows)))
    parts.append(_table(("SNR (dB)", "samples"), [(f"{snr:g}", number) for snr, number in sorted(snrs.items())]))
    sizes = [entry["bytes"] / 1e6 for entry in shards.shards]
    parts.append(
        f"{len(sizes)} shards of {min(sizes):.1f} to {max(sizes):.1f} MB, {sum(sizes) / 1e3:.3f} GB in all, "
        f"{1e3 * sum(sizes) / max(1, len(shards)):.1f} kB a sample.\n"
    )
    return "\n".join(parts)


def write_samples(shards: ShardSet, path: Path) -> None:
    """Write the table of all samples (CSV, columns FIELDS), in the order of the index."""
    records, _, _ = _census(shards)

    def rows() -> Iterator[tuple]:
        """One row of the table for each sample."""
        for entry, table in shards.tables():
            columns = (table[name].tolist() for name in ("key", "label", "model", "snr_db"))
            for key, label, model, snr_db in zip(*columns, strict=True):
                record = records[_slug(key.decode())]
                row = (key.decode(), label, record["category"], record["subtype"], entry["group"], entry["fold"])
                name = key.decode().rpartition("-")[0] if shards.kind == "recipe" else key.decode()
                yield (*row, model, f"{snr_db:g}", entry["name"], f"{name}.{EXTENSIONS[shards.kind]}")

    write_csv(path, tuple(FIELDS), rows())


def description(shards: ShardSet) -> str:
    """Return the data set in one paragraph."""
    stations = station_names(shards.index["render"]["network"])
    what = WHAT[shards.kind].format(stations=len(stations), columns=len(shards.spectra))
    return (
        f"Simulated echoes of low-altitude targets ({', '.join(map(plural, shards.classes))}) at the base stations "
        f"{', '.join(stations)} of a networked sensing system, {len(shards)} samples as {what}, "
        "with motion parameters and geometry of every sample. Made by lowalt after 'Networked ISAC Enabled Target "
        "Recognition Towards Low-Altitude Economy' (Luo et al.); the samples are not that paper's own."
    )


def readme(shards: ShardSet, config: str, name: str, license_name: str) -> str:
    """Return the data card as Markdown with the metadata block that dataset hubs read; `config`: the run's YAML."""
    images = len(shards.columns())
    example = shards.shards[0]["path"] if shards.shards else "SHARD.tar"
    first = shards.record(0) if len(shards) else {"versions": {"lowalt": __version__}}
    return f"""---
{yaml.safe_dump(front(shards, name, license_name), sort_keys=False).strip()}
---
# {name}

{description(shards)}

## What is in it

{_counts(shards)}
## How to read it

{READING[shards.kind].format(spectra=", ".join(name.upper() for name in shards.spectra))}
`samples.csv` lists all samples, `index.json` the shards with their SHA-256, and the `.npz` beside a shard the offset,
size and SHA-256 of each of its samples; `croissant.json` describes all of it to machines.

```python
import datasets
samples = datasets.load_dataset("FOLDER OR REPOSITORY", "seen", split="train")

import webdataset
for sample in webdataset.WebDataset("{example}", shardshuffle=False).decode("pil"):
    print(sample["__key__"], sample["json"]["category"], sample["{EXTENSIONS[shards.kind]}"])

from lowalt.shards import ShardSet
shards = ShardSet("index.json", groups=["seen"], folds=["train"])
images, label = shards.images(0, size=224), shards.labels[0]  # ({images}, 224, 224) uint8
```

`lowalt verify index.json` checks every byte of every file and names what is damaged;
`sha256sum --check SHA256SUMS` does the same without this package, file by file.

**Protocols.** *seen*: train, val and test folds of both groups. *unseen*: folds of the `seen` group, and all folds
of the `unseen` group as the test on subtypes that training has not met.

## Known limits

{LIMITS}
## Oddities to know

{ODDITIES}
## Licence

{license_name} ({LICENSES[license_name]}). Inputs that a user adds (meshes, recordings) keep their own licences.

## What made it

{_table(("package", "version"), sorted(first["versions"].items()))}
The exact configuration, which makes the same bytes again with these versions:

```yaml
{config.strip()}
```
"""


def write(index_path: str | Path, config_path: str | Path, license_name: str = "MIT", **facts: str) -> None:
    """Write README.md, samples.csv and croissant.json next to an index, and the checksums of all of it.

    facts: further properties of the Croissant description, such as `url` and `datePublished`.
    Raises: InputError where the licence is not one of LICENSES, or a file is missing or damaged.
    """
    if license_name not in LICENSES:
        raise InputError(f"--license: {license_name!r}, expected one of {sorted(LICENSES)}")
    shards, config = ShardSet(index_path), text_of(config_path, "configuration")
    name = f"lowalt-{yaml.safe_load(config)['run']}"
    folder = Path(index_path).parent
    with replacing(folder / "README.md") as temporary:
        temporary.write_text(readme(shards, config, name, license_name))
    samples = folder / "samples.csv"
    write_samples(shards, samples)
    table = {"path": samples.name, "bytes": samples.stat().st_size, "sha256": sha256(samples)}
    known = {
        "name": name, "description": description(shards), "version": __version__,
        "license": LICENSES[license_name], "citeAs": PAPER, **facts,
    }  # fmt: skip
    with replacing(folder / "croissant.json") as temporary:
        temporary.write_text(json.dumps(metadata(shards.index, table, known), indent=1) + "\n")
    checksums.write(index_path, shards.index)


def main(arguments: list[str]) -> None:
    """Write the data card, the table of samples and the Croissant description next to the index."""
    line = argparse.ArgumentParser(prog="python -m lowalt.shards.card", description=main.__doc__)
    line.add_argument("--index", required=True, help="the data set's index")
    line.add_argument("--config", required=True, help="the merged configuration that made it (.yaml)")
    line.add_argument("--license", default="MIT", choices=sorted(LICENSES), help="licence of the data (default MIT)")
    line.add_argument("--url", help="where the data set will be published")
    line.add_argument("--date", help="day of publication, YYYY-MM-DD")
    options = line.parse_args(arguments)
    facts = {"url": options.url, "datePublished": options.date}
    write(options.index, options.config, options.license, **{key: text for key, text in facts.items() if text})


if __name__ == "__main__":
    run(main)
