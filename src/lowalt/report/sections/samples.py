"""Section: one sample of each category as the network sees it."""

from lowalt.report.figures.style import embedded
from lowalt.report.figures.tiles import example_tiles
from lowalt.report.run import Run


def values(run: Run) -> dict:
    """Return the stations and the example tiles with their captions."""
    tiles = [{"caption": text, "picture": embedded(data)} for text, data in example_tiles(run.shards)]
    return {"stations": run.stations, "tiles": tiles}
