"""Aspect and occlusion along reflected routes: by the ground or a facade a target shows another side.

A point sees the station in the mirror, so the way there and back by one reflected path has the aspect and the shadows
of a station at the mirror image's place. Out by one path and back by another, each way counts with the root of its own
two-way factor. Without this effect all paths have the direct one's aspect and shadows.
"""

from collections.abc import Callable, Sequence

import numpy as np

from lowalt.common.errors import InputError
from lowalt.effects.catalogue import NamedEffect
from lowalt.effects.checks import CheckedScene
from lowalt.effects.response import ImagePath
from lowalt.effects.view import View

SOURCE = (
    "images of the station: Balanis, Advanced Engineering Electromagnetics, section 7.4; product of one factor for "
    "each way: reciprocity, exact for a Lambert surface (Lambert's cosine law, cos i cos s) and for opaque shadows, an "
    "estimate for facets"
)
DEFAULTS = {"follow": ["cross_sections", "fluctuation", "occlusion"]}

FOLLOWED = tuple(DEFAULTS["follow"])
"""Effects that depend on the side that a target shows."""


def idle(settings: dict) -> bool:
    """Return whether no effect is evaluated along the reflected routes."""
    return not settings["follow"]


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError where the scene has no reflected route, or none of the effects in `follow`."""
    if not {"ground_reflection", "walls"} & set(scene.effects):
        raise InputError(
            "effects.reflected_aspect: there is no reflected route, expected ground_reflection or walls in the same "
            "scene"
        )
    if not set(settings["follow"]) & set(scene.effects):
        raise InputError(
            f"effects.reflected_aspect.follow: {settings['follow']}, expected one of the scene's effects among "
            f"{list(FOLLOWED)}"
        )


def routes(
    settings: dict, view: View, paths: Sequence[ImagePath], weighing: Sequence[NamedEffect],
    product: Callable[[Sequence[NamedEffect], View], np.ndarray | float],
) -> np.ndarray:  # fmt: skip
    """Return the factors (R, N, L) on two-way amplitudes, there and back by the direct path and each of `paths`.

    Of a link (R, R, N, L), by the path of its sender and that of its receiver.
    """
    if view.station.transmitter is not None:
        return between(settings, view, paths, weighing, product)
    following = [effect for effect in weighing if effect.name in settings["follow"]]
    others = [effect for effect in weighing if effect not in following]
    result = np.empty((1 + len(paths), *view.places.shape[:2]))
    for number, path in enumerate((None, *paths)):
        if path is None or path.station_m is None:
            result[number] = product(weighing, view)
        else:
            result[number] = product(others, view) * product(following, view.seen_from(path.station_m))
    return result


def between(
    settings: dict, view: View, paths: Sequence[ImagePath], weighing: Sequence[NamedEffect],
    product: Callable[[Sequence[NamedEffect], View], np.ndarray | float],
) -> np.ndarray:  # fmt: skip
    """Return the factors (R, R, N, L) on a link's amplitudes, by the path of its sender and that of its receiver.

    Both ends by the same kind of path are the link between their images. For other pairs each way counts with the root
    of the two-way factor of a station at its end's image, as at a station.
    """
    result = np.ones((1 + len(paths), 1 + len(paths), *view.places.shape[:2]))
    senders = [path.sender or path for path in paths]
    for effect in weighing:
        own = product([effect], view)
        if effect.name not in settings["follow"]:
            result *= own
            continue
        out, back = (
            [product([effect], end if place is None else end.seen_from(place)) for place in (None, *images)]
            for end, images in zip(
                view.ends(), ([path.station_m for path in some] for some in (senders, paths)), strict=True
            )
        )
        for a, b in np.ndindex(result.shape[:2]):
            if a != b:
                result[a, b] *= np.sqrt(out[a] * back[b])
            elif a == 0 or paths[a - 1].station_m is None:
                result[a, b] *= own
            else:
                result[a, b] *= product([effect], view.seen_from(paths[a - 1].station_m, senders[a - 1].station_m))
    return result
