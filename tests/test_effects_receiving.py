"""The way of a look through receiver effects: as samples, or as their transform where that saves transforms."""

from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from lowalt.common.errors import InputError
from lowalt.effects import one_way, receiving

OFFERS = {"plain": ("receive",), "takes": ("receive", "retimed"), "both": ("receive", "retimed", "retoned")}


@pytest.mark.parametrize(
    ("kinds", "expected"),
    [
        (["both"], ["retoned"]),
        (["both", "both"], ["retoned", "retoned"]),
        (["both", "takes"], ["retoned", "retimed"]),
        (["both", "plain"], ["retimed", "receive"]),
        (["plain", "both"], ["receive", "retoned"]),
        (["takes", "both"], ["retimed", "retoned"]),
        (["takes", "takes"], ["retimed", "retimed"]),
    ],
)
def test_tones_stay_where_all_that_follows_changes_them_or_the_next_effect_begins_with_them(kinds, expected):
    """Effects that change nothing: what is seen is which function of each is asked, and that no transform is lost."""
    asked, effects = [], []

    def step(name):
        def work(settings, given, frame, rng):
            asked.append(name)
            return np.fft.ifft(given, axis=1) if name == "retimed" else given.copy()

        return work

    for name, kind in zip(("phase_noise", "clock_offset"), kinds, strict=False):
        module = ModuleType(name)
        vars(module).update({offered: step(offered) for offered in OFFERS[kind]})
        effects.append(SimpleNamespace(name=name, settings={}, module=module))
    sending = SimpleNamespace(carrying=lambda tones, rows: (tones,))
    built = SimpleNamespace(frame=None, again=False, draws=lambda name: None, sending=sending)
    tones = np.exp(1j * np.arange(12.0)).reshape(3, 4)
    heard = receiving.Receiving._behind(built, effects, slice(None), tones=tones.copy())
    assert asked == expected
    np.testing.assert_allclose(heard.responses, tones, rtol=1e-12)


@pytest.mark.parametrize(("symbol", "point"), [(0, 0), (0, 6), (2, 3)])
def test_a_point_in_a_station_is_named_with_its_symbol(symbol, point):
    look = SimpleNamespace(places=np.empty((4, 7, 3)), name="B")
    with pytest.raises(InputError, match=f"at symbol {symbol} is that of station B"):
        one_way.PathFactors._check(look, symbol * 7 + point + 1)
    assert one_way.PathFactors._check(look, 0) is None
