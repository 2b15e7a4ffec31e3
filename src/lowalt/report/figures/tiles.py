"""One clean sample of each category out of the shards, as pictures for the page."""

import numpy as np

from lowalt.shards import ShardSet
from lowalt.tiles.png import encode


def example_tiles(shards: ShardSet) -> list[tuple[str, bytes]]:
    """Return (caption, PNG bytes) of the sample of highest SNR of each category's first motion model in the set."""
    chosen = []
    for label, category in enumerate(shards.classes):
        numbers = np.flatnonzero(shards.labels == label)
        if len(numbers):
            best = numbers[np.lexsort((shards.keys[numbers], -shards.snrs_db[numbers]))[0]]
            record = shards.record(int(best))
            noise = "no noise" if np.isinf(shards.snrs_db[best]) else f"SNR {shards.snrs_db[best]:g} dB"
            caption = f"{category}: {record['subtype']}, motion model {record['model']}, {noise}"
            stored = shards.kind == "image"
            picture = shards.png(int(best)) if stored else encode(shards.tile(int(best)), shards.palette)
            chosen.append((caption, picture))
    return chosen
