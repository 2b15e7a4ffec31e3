"""Analogue-to-digital converter: a uniform mid-rise quantiser with clipping, on I and Q alike."""

import math

import numpy as np

from lowalt.common.jit import INLINED, LEAN
from lowalt.effects import transforms
from lowalt.effects.transform_loops import transformed
from lowalt.effects.waveform import Frame

SOURCE = (
    "W. R. Bennett, Spectra of quantized signals, Bell Syst. Tech. J. 27(3), 1948; "
    "A. Gersho, R. M. Gray, Vector Quantization and Signal Compression, 1992, ch. 5 (mid-rise quantiser, overload)"
)
DEFAULTS = {"bits": 12, "backoff_db": 12.0, "clip": True}
DRAWS_NOTHING = NEEDS_NO_DATA = True


def idle(settings: dict) -> bool:
    """Return True without a number of bits."""
    return not settings["bits"]


def amplifies(settings: dict) -> float:
    """Return infinity: a quantiser is a staircase."""
    return math.inf


def quantise(samples: np.ndarray, bits: int, full_scale: float, clip: bool = True) -> tuple[np.ndarray, int]:
    """Return samples with I and Q at the middles of 2^bits steps of [-full_scale, full_scale], and the number clipped.

    A component outside the range is put in the outermost step or, with clip False, in a step of its own. Source: Gersho
    and Gray 1992, ch. 5.
    """
    parts = np.ascontiguousarray(samples, np.complex128).view(np.float64).reshape(-1)
    out = np.empty_like(parts)
    most = _most(bits, clip)
    clipped = _steps(parts, _height(full_scale, bits), most, full_scale, out)
    return out.view(np.complex128).reshape(samples.shape), int(clipped)


def _height(full_scale: float, bits: int) -> float:
    """The height of each of the 2^bits steps that fill twice the range."""
    return full_scale * 2.0 ** (1 - bits)


def _most(bits: int, clip: bool) -> float:
    """The number of steps to each side of zero."""
    return 2.0 ** (bits - 1) if clip else np.inf


@INLINED
def _middle(part, step, most):
    """The middle of the step that a part falls into, `most` to each side."""
    code = np.floor(part / step)
    code = code if code > -most else -most
    code = code if code < most - 1.0 else most - 1.0
    return (code + 0.5) * step


@LEAN
def _steps(parts, step, most, full_scale, out):
    """Fill out (K,) with the middles of the steps of parts (K,), `most` to each side; return how many are clipped."""
    clipped = 0
    for i in range(np.uint64(len(parts))):
        out[i] = _middle(parts[i], step, most)
        clipped += 1 if abs(parts[i]) > full_scale else 0
    return clipped


@LEAN
def _stepped_tones(given, back, step, most, table, work, out):
    """Fill out (N, 256) with the transform of the middles of the steps of samples (N, 256), as in `_steps`.

    given: the samples, or with `back` their tones; it may be out itself. table: as `transform_loops.turns` returns it;
    work: (4, 256).
    """
    count, scale = np.uint64(256), 1.0 / 256
    for n in range(len(given)):
        row, new = given[n], out[n]
        re, im, new_re, new_im = work[0], work[1], work[2], work[3]
        for i in range(count):
            re[i], im[i] = row[i].real, row[i].imag
        if back:
            # Real and imaginary parts change places: the inverse transform.
            transformed(im, re, new_im, new_re, table)
            re, im, new_re, new_im = new_re, new_im, re, im
            for i in range(count):
                re[i], im[i] = scale * re[i], scale * im[i]
        for i in range(count):
            re[i] = _middle(re[i], step, most)
        for i in range(count):
            im[i] = _middle(im[i], step, most)
        transformed(re, im, new_re, new_im, table)
        for m in range(count):
            new[m] = complex(new_re[m], new_im[m])


def full_scale(samples: np.ndarray, backoff_db: float) -> float:
    """Return the converter's range: a component's root mean square over the look, times the back-off."""
    parts = np.ascontiguousarray(samples, np.complex128).view(np.float64).reshape(-1)
    return math.sqrt(float(np.dot(parts, parts)) / parts.size) * 10 ** (backoff_db / 20)


def step(settings: dict, samples: np.ndarray) -> float:
    """Return the height of a step for these samples, zero for a look of zeros."""
    return _height(full_scale(samples, settings["backoff_db"]), settings["bits"])


def receive(settings: dict, samples: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return the converter's output (N, M); the gain before it is set once for the whole look.

    A look of zeros stays zeros. Source: Bennett 1948; nothing is drawn.
    """
    scale = full_scale(samples, settings["backoff_db"])
    return quantise(samples, settings["bits"], scale, settings["clip"])[0] if scale > 0 else samples


def toned(settings: dict, samples: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return the tones (N, M) of what `receive` returns, which are then not written as samples."""
    scale = full_scale(samples, settings["backoff_db"])
    if not scale > 0 or samples.shape[1] != transforms.LENGTH:
        return transforms.forward(receive(settings, samples, frame, rng))
    given = np.ascontiguousarray(samples, np.complex128)
    return _converted(settings, given, False, scale, np.empty(samples.shape, np.complex128))


def retoned(settings: dict, tones: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return the tones (N, M) of what `receive` returns of the samples of tones (N, M), which are overwritten.

    The range follows from the tones: by Parseval's theorem the mean power of samples is that of tones over M.
    """
    if tones.shape[1] != transforms.LENGTH:
        return toned(settings, transforms.inverse(tones, out=tones), frame, rng)
    scale = full_scale(tones, settings["backoff_db"]) / math.sqrt(tones.shape[1])
    return _converted(settings, tones, True, scale, tones) if scale > 0 else tones


def _converted(settings: dict, given: np.ndarray, back: bool, scale: float, out: np.ndarray) -> np.ndarray:
    """The tones (N, M) of the converter's output, in `out`; given, back: as in `_stepped_tones`."""
    height, most = _height(scale, settings["bits"]), _most(settings["bits"], settings["clip"])
    _stepped_tones(given, back, height, most, transforms.table(), transforms.work(), out)
    return out
