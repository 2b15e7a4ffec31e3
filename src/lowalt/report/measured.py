"""Pictures and page of the comparison with measurements, from what `python -m lowalt.recordings` computed.

    python -m lowalt.report.measured --pairs FOLDER --tables FOLDER --page FILE

draws every pair-NAME.npz as measured-NAME.png into the folder of tables, all pairs side by side as
measured-overview.png, and the vehicles' pair without its third row as measured-short.png. The page has the one section
"Held against measurement".
"""

import argparse
from pathlib import Path

from lowalt.config.command import run
from lowalt.files.atomic import replacing
from lowalt.report.figures.measured import overview, pair_picture, read_pair
from lowalt.report.page import section_page
from lowalt.report.sections.measured import held


def main(arguments: list[str]) -> None:
    """Draw the pictures that there are, then write the page; recordings that stand in no pair have tables alone.

    Raises: InputError where a table is missing.
    """
    options = argparse.ArgumentParser(prog="python -m lowalt.report.measured", description=__doc__)
    options.add_argument("--pairs", required=True, type=Path, help="folder of pair-NAME.npz")
    options.add_argument("--tables", required=True, type=Path, help="folder of measured-*.csv; pictures go there too")
    options.add_argument("--page", required=True, type=Path, help="page to write (.html)")
    given = options.parse_args(arguments)
    pairs = {path.stem.removeprefix("pair-"): read_pair(path) for path in sorted(given.pairs.glob("pair-*.npz"))}
    pictures = {name: pair_picture(pair) for name, pair in pairs.items()}
    if pairs:
        pictures["overview"] = overview(list(pairs.values()))
    if "vehicle" in pairs:
        pictures["short"] = pair_picture(pairs["vehicle"], ("measured", "simulated"))
    for name, picture in pictures.items():
        with replacing(given.tables / f"measured-{name}.png") as temporary:
            temporary.write_bytes(picture)
    text = section_page("Held against measurement", "measured", held(given.tables))
    with replacing(given.page) as temporary:
        temporary.write_text(text)


if __name__ == "__main__":
    run(main)
