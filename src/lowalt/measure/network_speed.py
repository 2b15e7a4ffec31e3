"""Time per sample of a scheme's network on this machine, for inference and for a training step.

    python -m lowalt.measure.network_speed --settings JSON --out speed.json

Settings: scheme, seed, size, colour_map, network, training, augmentation, classes.
The weights are untrained, because time does not depend on them. The images are in memory, so
reading is not timed. The minimum of several passes is used, because other work on the machine can
only add time. On one thread the time is processor time.
"""

import functools
import json
import time
from collections.abc import Callable

import numpy as np
import torch

from lowalt.config.command import parser, pick, run
from lowalt.files.atomic import write_file
from lowalt.machine.hardware import describe
from lowalt.machine.timing import least_s
from lowalt.recognition import recipe, recogniser
from lowalt.recognition.inference import Machine
from lowalt.recognition.objective import objective
from lowalt.recognition.recogniser import built
from lowalt.recognition.schemes import Scheme, with_scheme

BATCHES = (1, 64)


def _clock(machine: Machine, threads: int) -> Callable[[], float]:
    """Return the clock (s): processor time on one thread, else wall time.

    On a GPU it waits until the work has finished.
    """
    if machine.device.type == "cuda":

        def finished() -> float:
            """Return the wall time (s) once the GPU has finished its work."""
            torch.cuda.synchronize()
            return time.perf_counter()

        return finished
    return time.process_time if threads == 1 else time.perf_counter


def _inputs(samples: int, scheme: Scheme, size: int) -> torch.Tensor:
    """Random images of a scheme's views; size: pixels per side."""
    generator = torch.Generator().manual_seed(0)
    shape = (samples, len(scheme.columns), size, size)
    return torch.randint(0, 256, shape, dtype=torch.uint8, generator=generator)


def measure(scheme: Scheme, settings: dict, limit_s: float = 2.0) -> dict:
    """Return the times of a scheme's network on one machine, in ms per sample, and its size.

    settings: {seed, size, colour_map, network, training, augmentation, classes}, as for a training;
    limit_s: seconds spent on one figure. A batch that takes longer than the limit is omitted
    (None). The batch of the training step is the largest power of two, up to the setting's batch,
    that takes at most a quarter of the limit. Its time is estimated from the largest timed batch,
    because a GPU processes one sample no faster than several. If the settings compile, the training
    step uses the compiled network, as in a training.
    Raises: InputError for a wrong setting.
    """
    pick(settings, "seed", "size", "colour_map", "network", "training", "augmentation", "classes")
    block = recipe.check(settings["training"])
    recipe.seeded(settings["seed"], ("speed",), block["threads"])
    machine = Machine.here(block["precision"])
    model = built(
        scheme,
        settings["network"],
        settings["size"],
        settings["colour_map"],
        len(settings["classes"]),
    )
    layout = torch.channels_last if block["channels_last"] else torch.contiguous_format
    model = model.to(machine.device, memory_format=layout)
    clock = _clock(machine, block["threads"])
    times: dict[str, float | None] = {}
    sample_s = 0.0
    with torch.inference_mode(), machine.autocast():
        model.eval()
        for batch in BATCHES:
            times[f"inference_ms_{batch}"] = None
            if sample_s * batch < limit_s:
                images = _inputs(batch, scheme, settings["size"]).to(machine.device)
                sample_s = least_s(functools.partial(model, images), limit_s, clock) / batch
                times[f"inference_ms_{batch}"] = 1e3 * sample_s
    # Forward and backward cost about three times a forward.
    most = max(1.0, min(block["batch"], limit_s / 4 / (3 * sample_s)))
    batch = 1 << int(np.log2(most))
    images = _inputs(batch, scheme, settings["size"]).to(machine.device)
    labels = torch.arange(batch) % len(settings["classes"])
    labels = labels.to(machine.device)
    steps = recipe.optimiser(model, block)
    model.train()
    trained = torch.compile(model) if block["compile"] else model

    def step() -> None:
        """Make one training step on the batch."""
        objective(trained, images, labels, block, machine).backward()
        steps.step()
        steps.zero_grad(set_to_none=True)

    if block["compile"] or machine.gpu:
        # Do not time the first call, which compiles or loads GPU kernels, once per training.
        step()
    return {
        "scheme": scheme.name,
        "size": settings["size"],
        "parameters": recogniser.parameters(model),
        **times,
        "train_ms": 1e3 * least_s(step, limit_s, clock) / batch,
        "train_batch": batch,
        "precision": machine.precision,
        "threads": block["threads"],
        "batch": block["batch"],
        "steps": block["steps"],
        "backbone": scheme.backbone or settings["network"]["backbone"],
        "hardware": describe(),
    }


def main(arguments: list[str]) -> None:
    """Time one scheme's network and write the record."""
    line = parser("lowalt.measure.network_speed", __doc__.partition("\n\n")[0])
    line.add_argument("--out", required=True, help="record to write (.json)")
    options = line.parse_args(arguments)
    record = measure(*with_scheme(options.settings))
    write_file(options.out, json.dumps(record, indent=1, sort_keys=True) + "\n")


if __name__ == "__main__":
    run(main)
