"""Fresh motion models as samples of a training, made as they are asked for: none is in the data
set, none comes twice.

The samples go round by round: each round has one motion model of every subtype, in a random order,
each at one random SNR. Motion models are numbered after those of the run and lie in the fold that
trains, so none is ever validated or tested, not even where the data set grows later.
"""

import json

import numpy as np

from lowalt.config.classes import label
from lowalt.config.splits import fold
from lowalt.files.errors import InputError
from lowalt.numerics.streams import stream
from lowalt.recognition.dataset_samples import stations_of, views_of
from lowalt.recognition.samples import Facts, Samples, fingerprint
from lowalt.recognition.schemes import columns_in
from lowalt.shards.dataset import Dataset, Place
from lowalt.shards.sample_record import sample_key
from lowalt.spectra.catalogue import named

STRIDE = 2**31
"""Distance of the motion models that one place may take: the first of them that lies in the fold
that trains.
"""


class Fresh(Samples):
    """So many fresh samples of the group "seen"; those of motion models that repeat are kept once
    made.
    """

    def __init__(
        self,
        dataset: Dataset,
        columns: list[int],
        size: int,
        count: int,
        models: int,
        without: list[str],
    ) -> None:
        """columns: views of a scheme; size: pixels; count: samples; models: distinct motion models
        over all subtypes, after which they repeat at other SNRs, or 0; without: subtypes that take
        no part.

        Raises: InputError where there are fewer models than subtypes.
        """
        maker = dataset.maker
        plan = dataset.plan
        self.dataset = dataset
        self.size = size
        self.columns = columns_in(
            columns, named(maker.render["spectra"]), len(maker.network.stations), "stream"
        )
        self.stations = stations_of(maker, self.columns)
        self.made: dict[Place, np.ndarray] = {}
        self.repeat = models > 0
        subtypes = [name for name in plan.groups["seen"] if name not in without]
        if 0 < models < len(subtypes):
            raise InputError(f"stream: {models} motion models of {len(subtypes)} subtypes")
        self.places: list[Place] = []
        for number in range(-(-count // len(subtypes))):
            drawn = stream(plan.seed, "recognition-stream", number)
            order = drawn.permutation(len(subtypes))
            levels = drawn.integers(0, len(plan.snrs), len(subtypes))
            for which in range(len(subtypes)):
                name = subtypes[int(order[which])]
                snr_db = plan.snrs[levels[which]]
                model = plan.models + (number % (models // len(subtypes)) if models else number)
                while fold(plan.split, plan.seed, name, model, snr_db) != "train":
                    model += STRIDE
                self.places.append(Place("seen", name, model, snr_db))
        del self.places[count:]
        labels = {
            name: label(dataset.classes, dataset.published[name] | {"subtype": name})
            for name in subtypes
        }
        nowhere = np.full((count, len(maker.network.stations)), np.nan)
        self.facts = Facts(
            np.array(
                [sample_key(place.subtype, place.model, place.snr_db) for place in self.places]
            ),
            *(
                np.array(column)
                for column in zip(
                    *((p.subtype, p.model, p.snr_db) for p in self.places), strict=True
                )
            ),
            np.full(count, "seen"),
            np.full(count, "train"),
            np.array([labels[place.subtype] for place in self.places], np.int64),
            nowhere,
            nowhere,
        )

    def views(self, numbers: np.ndarray) -> np.ndarray:
        """Index images (len(numbers), columns, size, size) uint8 of the samples `numbers`."""
        found = []
        maker = self.dataset.maker
        for place in (self.places[number] for number in numbers):
            images = self.made.get(place)
            if images is None:
                row = self.dataset.row(place)
                images = views_of(maker, row, place.snr_db, self.columns, self.size, self.stations)
                if self.repeat:
                    self.made[place] = images
            found.append(images)
        return np.stack(found)

    def sha256(self) -> str:
        """Return the SHA-256 of all that decides these samples but their clouds."""
        maker = self.dataset.maker
        told = [
            maker.render,
            maker.echo,
            self.dataset.config["motion"],
            self.dataset.plan.seed,
            self.columns,
            self.size,
        ]
        return fingerprint(self.facts, json.dumps(told, sort_keys=True).encode())
