"""The fast kernel run by the interpreter on a small scene, with parts of its error left out, and the truth about it."""

from types import SimpleNamespace

import numpy as np
import pytest

from interpreted import interpreted
from lowalt.echo import refine
from lowalt.echo.fast import driver
from lowalt.echo.fast.range_bounds import SPREAD
from lowalt.echo.fast.workspace import Found
from lowalt.echo.pointwise.reference_range import CELL, RANGE, REST
from small_echo import NETWORK, TAU, dirichlet, pieces, places, prepared, seen

RUN = interpreted(driver.run)


def weights(count, seed=5):
    """Cross sections (m2) of which no two are alike."""
    return np.random.default_rng(seed).uniform(0.2, 3.0, count)


def computed(motion, error=0.0, **given):
    """Return the kernel's results for a motion, the sample, the approximation and what `prepared` gives.

    error: for which a plan is made; given: `net`; `change`: a function from the approximation to its changed fields;
    `final` of the kernel; `extents`: columns set to a number or to numbers of symbols; `symbols`: which.
    """
    there = prepared(motion, weights(places(motion).shape[1]), given.get("net", NETWORK))
    sample = refine._Sample(there.scene, there.radio, there.refs, there.aims)
    for column, values in given.get("extents", {}).items():
        sample.extents[:, column] = values
    approximation = sample.approximation(sample.plan(error))
    approximation = approximation._replace(**given.get("change", lambda _: {})(approximation))
    sample.approximation = lambda _: approximation
    found = Found.empty(len(there.refs))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(refine, "driver", SimpleNamespace(run=RUN))
        symbols = given.get("symbols", np.arange(len(there.refs)))
        sample.compute(symbols, approximation.plan, given.get("final", True), found)
    return found, sample, approximation, there


def amplitudes(there, motion):
    """Truly: amplitudes (N, L) complex without the cells' phases, and ranges in cells (N, L)."""
    view = seen(there, motion)
    net = there.net
    rcs = weights(places(motion).shape[1])
    elements = np.prod(net.transmit) * np.prod(net.receive)
    scale = np.sqrt(net.power / elements) * (299_792_458 / net.carrier_hz) / (2 * TAU) ** 1.5
    size = scale * elements * np.sqrt(rcs) * view.gain_h * view.gain_v / view.range_m**2
    return size * np.exp(1j * TAU * (view.turn - np.rint(view.turn))), view.cells


def truth_of(there, motion):
    """Amplitudes and ranges as `amplitudes`, and all cells (N, M)."""
    (z, cells), net = amplitudes(there, motion), there.net
    number = np.arange(net.subcarriers)
    weight = dirichlet((number[:, None, None] - cells) / net.subcarriers, net.subcarriers) / net.subcarriers
    own = np.exp(1j * TAU / 2 * ((net.subcarriers - 1) * number % (2 * net.subcarriers)) / net.subcarriers)
    return z, cells, ((weight * z).sum(-1) * own[:, None]).T


def bare(**given):
    """Change an approximation so that no error is left in it but those given."""

    def change(approximation):
        """The fields of an approximation that are changed."""
        plan = approximation.plan._replace(**({"share": 0.0, "peak": 0.0, "phase": 0.0} | given.get("plan", {})))
        cells = approximation.cells._replace(**({"error": 0.0} | given.get("cells", {})))
        return {"plan": plan, "cells": cells}

    return change


def sums_of(motion):
    """Truly: each symbol's sum of |z|, of |z| v^2 (v in cells from the middle of all), and of the peak amplitudes."""
    *_, sample, approximation, there = computed(motion)
    z, cells = amplitudes(there, motion)
    ref = there.refs
    centre = np.rint((ref[:, REST] + 0.5) * 32) / 32 - 0.5
    half = approximation.cells.half
    v = (cells - ref[:, [CELL]] - centre[:, None]) / half
    peaks = there.peak * np.sqrt(weights(z.shape[1])).sum() / (ref[:, RANGE] * (1 - sample.extents[:, SPREAD])) ** 2
    return (np.array(each, float) for each in (abs(z).sum(1), (abs(z) * v**2).sum(1), peaks))


MOTION = pieces(symbols=2)
SMALL = 1e-4
"""An error that is far above all roundings, and whose square is far below it."""
