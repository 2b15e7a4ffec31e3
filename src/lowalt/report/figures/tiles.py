"""One clean sample of each category out of the shards, as pictures for the page."""

import io

import numpy as np
from PIL import Image

from lowalt.shards import ShardSet


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
            chosen.append((caption, _picture(shards, int(best))))
    return chosen


def _picture(shards: ShardSet, number: int) -> bytes:
    """PNG of a sample: the stored one, or one drawn from its signals."""
    if shards.kind == "image":
        return shards.png(number)
    buffer = io.BytesIO()
    picture = Image.fromarray(shards.tile(number), "P")
    picture.putpalette(np.ascontiguousarray(shards.palette).tobytes())
    picture.save(buffer, "PNG")
    return buffer.getvalue()
