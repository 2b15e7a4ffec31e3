"""The way of a look through receiver effects: as samples, or as their transform where that saves transforms."""

from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from lowalt.effects import receiving

OFFERS = {"plain": ("receive",), "takes": ("receive", "retimed"), "both": ("receive", "retimed", "retoned")}


@pytest.mark.parametrize(
    ("kinds", "expected"),
    [
        (["both"], ["retoned"]),
        (["both", "both"], ["retoned", "retoned"]),
        (["both", "takes"], ["retoned", "retimed"]),
        (["both", "plain"], ["retimed", "receive"]),
        (["plain", "both"], ["receive", "retoned"]),
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
    built = SimpleNamespace(frame=None, draws=lambda name: None, sending=sending)
    tones = np.exp(1j * np.arange(12.0)).reshape(3, 4)
    heard = receiving.Receiving._behind(built, effects, slice(None), tones=tones.copy())
    assert asked == expected
    np.testing.assert_allclose(heard.responses, tones, rtol=1e-12)
