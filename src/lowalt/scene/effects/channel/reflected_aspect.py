"""Aspect and occlusion along reflected paths.

The ground and a facade see another side of a target than the station.

A point sees a reflected path come from the station's mirror image. Out and back on that path, the
target has the aspect and the shadows that a station at the mirror image would see. Where the
outward and the return path differ, the factor is the root of the product of both two-way factors.
Without this effect, all paths have the aspect and the shadows of the direct path.
"""

from collections.abc import Callable

import numpy as np

from lowalt.files.errors import InputError
from lowalt.scene.checks import CheckedScene
from lowalt.scene.effects import with_offer
from lowalt.scene.response import ImagePath
from lowalt.scene.view import View

SOURCE = (
    "images of the station: Balanis, Advanced Engineering Electromagnetics, section 7.4; product "
    "of one factor for each way: reciprocity, exact for a Lambert surface (Lambert's cosine law, "
    "cos i cos s) and for opaque shadows, an estimate for facets"
)
DEFAULTS: dict[str, float] = {}


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError where the scene has no reflected path, or no side to follow.

    An effect must depend on the side that a target shows.
    """
    if not scene.offering("paths"):
        raise InputError(
            "effects.reflected_aspect: there is no reflected route, expected "
            f"{with_offer('paths')} in the same scene"
        )
    if not scene.offering("ONE_SIDED"):
        raise InputError(
            f"effects.reflected_aspect: no side to follow, expected {with_offer('ONE_SIDED')} in "
            "the same scene"
        )


def routes(
    settings: dict, view: View, paths: list[ImagePath], weight: Callable[..., np.ndarray]
) -> np.ndarray:
    """Return the factors (R, R, N, L) on two-way amplitudes.

    Waves go out by path a and back by path b, the direct one first.

    weight(view, one_sided): product (N, L) of the effects' amplitude factors as `view` sees them.
    On a link, both ways by the same kind of path are the link between both images. A path without
    an image of the station shows the direct one's side: in a town it is the change of the direct
    path, which must cancel a blocked direct path.
    """
    rest = weight(view, one_sided=False)
    ends = view.ends()
    heard = [None, *(path.station_m for path in paths)]
    sent = [None, *(path.outward.station_m for path in paths)]

    def two_way(
        end: View, image_m: np.ndarray | None, sender_m: np.ndarray | None = None
    ) -> np.ndarray:
        """The followed effects' factor (N, L) for a station, or a link, at its image."""
        if image_m is None and sender_m is None:
            return weight(end, one_sided=True)
        place_m = end.masts_m[1] if image_m is None else image_m
        return weight(end.seen_from(place_m, sender_m), one_sided=True)

    back = [two_way(ends[-1], image_m) for image_m in heard]
    out = back
    same = back
    if len(ends) == 2:
        out = [two_way(ends[0], image_m) for image_m in sent]
        same = [two_way(view, *images_m) for images_m in zip(heard, sent, strict=True)]
    result = np.empty((len(heard), len(heard), *view.places.shape[:2]))
    for a, b in np.ndindex(result.shape[:2]):
        if a == b:
            sides = same[a]
        elif sent[a] is None and heard[b] is None:
            sides = same[0]
        else:
            sides = np.sqrt(out[a] * back[b])
        result[a, b] = rest * sides
    return result
