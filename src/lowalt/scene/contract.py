"""The contract of effects: the functions that an effect may offer.

The contract says for each where effects that offer it act, what it takes and returns, and whether
several effects of one scene may offer it.

An effect is a module `effects/PLACE/NAME.py`, or a file of the user's own that a configuration
names by its path. It defines SOURCE, where its law comes from; DEFAULTS, every parameter with its
value; and one or more of the functions `OFFERS`. Each takes `settings`, which hold every key of
DEFAULTS, and then the arguments that `takes` lists. It may also define

- IDLE, a list of sets of settings: where a scene's settings hold all values of one set, the effect
  changes nothing and is left out of the chain;
- `check(settings, scene)`, which raises InputError where settings contradict the rest of a
  `checks.CheckedScene`;
- UNMODELLED, what the effect is not modelled with: "links" between two stations, the waveforms
  "fmcw" and "cw";
- STILL, whether it adds echoes that stand still, which a filter over the symbols removes;
- SET_SNR, the setting that holds an SNR of noise.snr_db: where it is null, the echo stage makes a
  signal for each SNR;
- STREAM, the name of its random stream, its own by default: effects with the same STREAM draw the
  same numbers;
- PARTS, settings that leave out one component of the effect, by the component's name: `lowalt
  explain` measures each;
- KINDS, settings of the kinds of the effect that `lowalt explain` compares, by the kind's name;
- TRIED, of an effect of the detection: `lowalt explain` tries it where the scene does not name it;
- DRAWN, for whom its stream is drawn: each "station" (default), the whole "look", or the "pair" of
  a link's stations;
- FILES, the settings that hold the path of a file which the effect reads: jobs run again when the
  file changes, and the file of a stranger may not choose it;
- `files(settings)`, all files that the effect reads, where those of FILES name further ones;
- `subtypes(settings)`, subtypes whose clouds it needs besides the target's own;
- SURFACES, whether it needs the opaque surfaces of the target;
- JUMPS, whether it draws the target's motion anew for each look, so that the looks of a track do
  not join;
- ONE_SIDED, whether its factor on amplitudes depends on the side that the target shows;
- WAVES, what the effect does to waves between a station and a target, as words that it shares with
  other effects: two effects with a word in common would count the same waves twice;
- `gaps(settings)`, whether symbols of a look are not received;
- `even(settings)`, whether it makes an evenly spaced signal that range cells of all symbols do not
  hold.

N symbols, M subcarriers or range cells, L points of a target; arrays are float64 or complex128.
"""

from typing import NamedTuple

import numpy as np

from lowalt.files.errors import InputError

PLACE_ORDER = ("motion", "transmitter", "channel", "receiver", "detection")
"""The places where effects act, in the order of the chain."""

ARGUMENTS = {
    "sent": "(N, M) complex128, data of mean power one, behind the effects that act earlier",
    "cells": "(N, M) complex128, range cells",
    "chosen": "(N,) int64, range cells chosen so far",
    "cloud": "`Cloud` of the target",
    "clouds": "clouds of all subtypes by name",
    "network": "`Network`",
    "on_air": "function of a symbol's name, see `SceneSample.on_air`, that returns its subcarriers "
    "(N, M) on the air",
    "look": "`Look`, what the receiver knows",
    "offset_cells": "distance of still echoes beyond the centres of their range cells, in cells",
    "paths": "list of P `ImagePath`, the direct path not among them",
    "response": "(N, M) complex128, frequency response in sqrt(W) a subcarrier",
    "rng": "Generator of the effect's own stream (STREAM, DRAWN), from its start",
    "row": "row of the motion table",
    "sample": "`SceneSample`",
    "samples": "(N, M) complex128, time samples",
    "signal": "(K,) complex128, the signal of the K symbols that were received",
    "subcarriers": "M",
    "symbols": "N",
    "times_s": "(N,) s",
    "timing": "`Sampling`",
    "view": "`View` of the target at the station",
    "wavelength_m": "wavelength of the carrier (m)",
    "weight": "`SceneSample.weight`, the product of the amplitude factors of all effects, of those "
    "with ONE_SIDED, or of the others",
}
"""What functions take, with shapes and units."""


def numbers(
    name: str, function: str, values: object, shapes: list[tuple[int, ...]], real: bool = False
) -> np.ndarray:
    """Return what a function of an effect gave as an array; real: whether it must not be complex.

    Raises: InputError naming the effect and its function for another shape than `shapes`, complex
    numbers in place of real ones, and NaN or infinity.
    """
    found = np.asarray(values)
    if found.shape not in shapes:
        raise InputError(
            f"{name}: {function} gives an array of shape {found.shape}, expected {shapes[0]}"
        )
    allowed = "biufc"
    kind = "numbers"
    if real:
        allowed = "biuf"
        kind = "real numbers"
    if found.dtype.kind not in allowed:
        raise InputError(f"{name}: {function} gives an array of {found.dtype}, expected {kind}")
    if not np.isfinite(found).all():
        raise InputError(f"{name}: {function} gives NaN or infinity, expected finite numbers")
    return found


class Offer(NamedTuple):
    """A function that an effect may offer.

    place: where effects that offer it act, "" for any place; one: whether a scene has one owner at
    most, else many act in the order of the chain; takes: names of ARGUMENTS behind `settings`;
    returns: its result.
    """

    place: str
    one: bool
    takes: tuple[str, ...]
    returns: str


ONE = True
MANY = False
OFFERS = {
    "perturb": Offer(
        "motion",
        MANY,
        ("cloud", "row", "times_s", "rng"),
        "`Perturbation` of the motion at these times",
    ),
    "sampling": Offer(
        "transmitter",
        ONE,
        ("network", "rng"),
        "`Sampling`: when symbols are sent, which are received",
    ),
    "regridded": Offer(
        "transmitter", ONE, ("signal", "timing", "network"), "(N,) evenly spaced signal"
    ),
    "data": Offer(
        "transmitter", ONE, ("symbols", "subcarriers", "rng"), "(N, M) data of mean power one"
    ),
    "aired": Offer("transmitter", MANY, ("sent",), "(N, M) subcarriers on the air"),
    "range_cells": Offer(
        "transmitter", ONE, ("response",), "(N, cells) of a response whose pilots alone are known"
    ),
    "beams": Offer(
        "channel",
        ONE,
        ("view", "rng"),
        "`Beams`: where both beams of a station point, and from when on",
    ),
    "element": Offer("channel", ONE, (), "`Element` of the antennas"),
    "cross_sections": Offer(
        "channel", MANY, ("cloud", "wavelength_m"), "(L,) m2, mean cross section of each point"
    ),
    "visible": Offer(
        "channel", MANY, ("view", "rng"), "(N, L) or (N, 1), real factor on two-way amplitudes"
    ),
    "visible_one_way": Offer(
        "channel",
        MANY,
        ("view", "rng"),
        "as `visible` for a station; on a link asked for at both ends, and the factor is the root "
        "of their product",
    ),
    "paths": Offer(
        "channel",
        MANY,
        ("view",),
        "list of `ImagePath`: waves go out by any path and come back by any",
    ),
    "routes": Offer(
        "channel",
        ONE,
        ("view", "paths", "weight"),
        "(P + 1, P + 1, N, L) factors by the way out and the way back, the direct one first",
    ),
    "waves": Offer(
        "channel",
        MANY,
        (),
        "keywords of `response.response`, the physics of arrays, each with True",
    ),
    "companions": Offer(
        "channel",
        MANY,
        ("cloud", "row", "clouds", "rng"),
        "(cloud, row) of each other target, alike for all stations",
    ),
    "instants": Offer(
        "channel", ONE, ("view",), "(Q,) s within a symbol, and their weights (Q, M) in its samples"
    ),
    "prefix_s": Offer("channel", ONE, ("network",), "length of the cyclic prefix (s)"),
    "late_samples": Offer(
        "channel", ONE, ("view",), "(N, L) int64, samples of a point that are the previous symbol's"
    ),
    "convolved": Offer(
        "channel",
        ONE,
        ("network", "response", "on_air", "offset_cells"),
        "(N, M) time samples of still echoes",
    ),
    "scatter": Offer(
        "channel", MANY, ("view", "rng"), "`Still`: the echoes of something other than a target"
    ),
    "from_sender": Offer(
        "channel", ONE, ("view",), "`Still`: what a link hears of its sender directly"
    ),
    "heard": Offer(
        "channel",
        MANY,
        ("sample",),
        "(N, M) time samples of signals that the receiver does not know",
    ),
    "displaced": Offer(
        "", MANY, ("view", "rng"), "`Displacement` of the target's echo by the effect"
    ),
    "noise_w": Offer(
        "receiver", ONE, ("network",), "mean power (W) of the receiver's noise in a subcarrier"
    ),
    "levels": Offer(
        "",
        MANY,
        ("view",),
        'list of lines of the link budget, (name, value, unit): a power in "W", or a ratio of '
        'powers, unit "1"',
    ),
    "receive": Offer(
        "receiver", MANY, ("samples", "look", "rng"), "(N, M) time samples after the effect"
    ),
    "filtered": Offer("detection", MANY, ("cells",), "(N, M) range cells behind a linear filter"),
    "record": Offer(
        "",
        MANY,
        ("network", "row", "rng"),
        "fields that it adds to the record of a sample, by name, alike for all SNRs; numbers, "
        "texts, lists and dicts that JSON holds",
    ),
    "choose": Offer(
        "detection", MANY, ("chosen", "cells", "look", "rng"), "(N,) chosen range cells"
    ),
}
"""All functions by name, in the order in which the chain asks for them."""
