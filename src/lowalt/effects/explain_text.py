"""The explanation of a scene as text for people, and the same facts as plain values for a program."""

import math

import numpy as np

from lowalt.common.hardware import describe
from lowalt.echo import method_text
from lowalt.effects.catalogue import BY_NEED
from lowalt.effects.explain import REPEATS, LinkGeometry, OwnEcho, Prefix, SampleFacts, SceneFacts
from lowalt.effects.levels import table


def text(found: SceneFacts) -> str:
    """Return the explanation of a scene as lines of text."""
    tolerance = "exact" if found.tolerance is None else f"{found.tolerance:g} of a sample's largest value"
    lines = [
        f"scene {found.run}: stations {', '.join(found.stations)}, tolerance {tolerance}, "
        f"SNRs {', '.join(f'{snr:g}' for snr in found.snr_db)} dB",
        "always (Eq. 7): beam pattern over the target, spread over range cells, 1/r^2 over the target, exact range; "
        "how, by sample, below",
    ]
    for effect in found.effects:
        cost = f" | +{found.ms[effect.name]:.2f} ms" if found.ms else ""
        kind = "by need" if effect.name in BY_NEED else effect.place
        values = ", ".join(f"{key} {value}" for key, value in effect.settings.items())
        lines += [f"{effect.name} ({kind}): {values or 'no parameters'}{cost}", f"  {effect.module.SOURCE}"]
    if found.idle:
        lines.append(f"named, but the identity with these parameters, so left out: {', '.join(found.idle)}")
    lines.append(f"not named, so not imported and nothing drawn: {', '.join(found.absent) or 'none'}")
    if found.ms:
        lines.append(
            f"time a sample and station: base {found.ms['base']:.2f} ms, with all effects {found.ms['together']:.2f} ms"
            f" (medians of {REPEATS}, mean over {len(found.samples)} samples; {describe()})"
        )
    for sample in found.samples:
        lines += ["", *_sample_lines(sample)]
    return "\n".join(lines)


def _sample_lines(sample: SampleFacts) -> list[str]:
    """Lines on one sample: of a station by its ranges and effects, of a link by its geometry."""
    name, station = f"{sample.subtype}, model {sample.model}", sample.station
    below = [prefix_line(sample.prefix)]
    table_lines = ["levels of one subcarrier:", *table(sample.levels)]
    if isinstance(sample.seen, LinkGeometry):
        out, back, angle = sample.seen
        head = f"{name}, link {station}: {out:.0f} m and {back:.0f} m"
        doppler = (
            f"bistatic angle {math.degrees(angle):.0f} degrees: Doppler is {math.cos(angle / 2):.2f} of 2 v / lambda "
            "along the bisector; all physics named is computed"
        )
        return [head, *(f"  {line}" for line in (doppler, *below, *table_lines))]
    seen = sample.seen
    for decision in seen.decisions:
        verb = "computed" if decision.computed else "left out"
        bound = "" if np.isinf(decision.bound) else f", bound {decision.bound:.2g} of the largest value"
        below.append(f"{decision.name}: {verb}{bound} ({decision.reason})")
    changed = (
        f"against the target's echo alone: rms change {seen.rms_change:.2g}, other range cell in "
        f"{seen.other_cells:.1%} of symbols"
    )
    lines = [*method_text(seen.echo).splitlines(), *below, *table_lines, changed]
    return [f"{name}, station {station}, range {sample.range_m:.0f} m", *(f"  {line}" for line in lines)]


def prefix_line(found: Prefix) -> str:
    """Return a line that says whether the cyclic prefix covers an echo, and its loss otherwise."""
    covered = f"cyclic prefix {1e6 * found.length_s:.3g} us, covers {found.covers_m:.0f} m"
    if found.lost == 0:
        return f"{covered}: this echo is within it"
    kept, spread = 1 - found.lost, max(1 - (1 - found.lost) ** 2, 1e-30)
    level = f"{20 * np.log10(kept):.1f} dB" if kept > 0 else "gone"
    modelled = "computed" if found.computed else "not modelled, name effects.cyclic_prefix"
    return (
        f"{covered}: this echo loses {found.lost:.0%} of its window, {level}; interference "
        f"{10 * np.log10(spread):.0f} dB a subcarrier, {10 * np.log10(spread / found.subcarriers):.0f} dB a range cell "
        f"({modelled})"
    )


def data(found: SceneFacts) -> dict:
    """Return the explanation of a scene as plain values: mappings, lists, texts and numbers."""
    effects = [
        {
            "name": effect.name, "place": effect.place, "by_need": effect.name in BY_NEED,
            "settings": effect.settings, "source": effect.module.SOURCE, "ms": found.ms.get(effect.name),
        }
        for effect in found.effects
    ]  # fmt: skip
    time = {"base_ms": found.ms["base"], "together_ms": found.ms["together"], "repeats": REPEATS,
            "hardware": describe()} if found.ms else None  # fmt: skip
    plain = found._asdict() | {"effects": effects, "samples": [_sample_data(one) for one in found.samples]}
    plain.pop("ms")
    return plain | {"time": time}


def _sample_data(sample: SampleFacts) -> dict:
    """One sample's facts as plain values; only a station that sends itself has a method and decisions."""
    plain = sample._asdict() | {
        "prefix": sample.prefix._asdict(),
        "levels": [level._asdict() for level in sample.levels],
    }
    seen = plain.pop("seen")
    if isinstance(seen, OwnEcho):
        own = seen._asdict() | {"decisions": [decision._asdict() for decision in seen.decisions]}
        echo = own.pop("echo")
        own["method"] = {"bound": echo.bound, "near_ties": echo.near_ties, **echo.method._asdict()}
        return plain | own
    return plain | {"link": seen._asdict()}
