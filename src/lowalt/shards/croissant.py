"""Croissant metadata of a data set: its shards with checksums, the table of its samples.

There is no record set with images, because tools would unpack every shard before returning the
first record.
Source: Croissant format specification 1.1 (MLCommons).
"""

from lowalt.config.classes import stated
from lowalt.shards.sample_table import EXTENSIONS
from lowalt.spectra.catalogue import named

TERMS = """
    arrayShape citeAs column containedIn dataBiases dataCollection equivalentProperty extract
    field fileObject fileProperty fileSet format includes isArray isLiveDataset jsonPath key md5
    parentField path personalSensitiveInformation recordSet references regex repeated replace
    samplingRate separator source subField transform
"""
"""Terms of the format whose prefixed name is cr:TERM."""
CONTEXT = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "cr": "http://mlcommons.org/croissant/",
    "dct": "http://purl.org/dc/terms/",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "sc": "https://schema.org/",
    "conformsTo": "dct:conformsTo",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "examples": {"@id": "cr:examples", "@type": "@json"},
    **{term: f"cr:{term}" for term in TERMS.split()},
}

FIELDS = {
    "key": ("sc:Text", "Unique name of the sample: subtype, motion model, SNR."),
    "label": ("sc:Integer", "Class: {}."),
    "category": ("sc:Text", "The class by name."),
    "subtype": ("sc:Text", "Published name of the target's subtype."),
    "group": (
        "sc:Text",
        "Whether the unseen protocol trains on the subtype (seen) or only tests on it (unseen).",
    ),
    "fold": ("sc:Text", "train, val or test."),
    "model": ("sc:Integer", "Number of the motion model within its subtype."),
    "snr_db": ("sc:Float", "Signal-to-noise ratio in dB, or inf."),
    "shard": ("sc:Text", "Shard that holds the sample's members KEY.json and its image or signal."),
    "file": ("sc:Text", "Name of the sample's image or signal in the shard."),
}
"""Columns of the table of all samples: data type and meaning; the label's names the classes."""

ARRAY = "application/octet-stream"
MEDIA = {
    "image": ("image/png", "{} x {} palette PNG of every sample: rows are stations, columns {}."),
    "signal": (
        ARRAY,
        "Signals of every sample (stations, symbols, re and im), float32, as an .npy file.",
    ),
    "cube": (
        ARRAY,
        "Range cells with noise of every sample (stations, symbols, cells, re and im), float32 or "
        "int16 times the record's step, as an .npy file.",
    ),
    "recipe": (
        ARRAY,
        "Echoes without noise of every motion model (stations, symbols, re and im), float32, as an "
        ".npy file.",
    ),
}
"""Media type and meaning of the member next to the record, by kind of shards."""
OF = {"image": "sample", "signal": "sample", "cube": "sample", "recipe": "motion model"}
"""What one member of a shard describes; all SNRs of a motion model share a recipe's member."""
RESPONSIBLE = {
    "dataCollection": "All samples are simulated from the configuration in README.md. No radar "
    "recorded them.",
    "dataCollectionType": ["Software Collection"],
    "dataCollectionRawData": "None. Samples follow from the configuration and the published sizes "
    "and rates.",
    "dataCollectionMissingData": "None: every motion model has a sample at every SNR. A number "
    "that does not apply to a target is 0 in its record, and one that is unknown is null.",
    "dataImputationProtocol": "No value is imputed.",
    "dataPreprocessingProtocol": [
        "README.md names the spectra, the noise and the scaling of the images."
    ],
    "dataAnnotationProtocol": [
        "The label is the class of the target that was simulated. No person annotated samples."
    ],
    "dataAnnotationAnalysis": [
        "Labels have no error and no disagreement, since the simulation knows its target."
    ],
    "annotationsPerItem": "One class, by construction.",
    "machineAnnotationTools": ["lowalt, which simulates the samples"],
    "dataUseCases": [
        "Training, validation and test of networks that recognise low-altitude targets in the "
        "echoes of base stations.",
        "Not suitable alone as evidence of the accuracy of a radar in operation.",
    ],
    "dataBiases": [
        "Motion models are drawn from the intervals of the configuration, not from observed "
        "traffic.",
        "Subtypes within a class are equally frequent, whatever their share among real targets.",
    ],
    "dataLimitations": [
        "Only the effects that the configuration names are simulated; README.md lists the known "
        "limits.",
        "Built-in targets are parametric models with published sizes and rates, not measured "
        "objects.",
    ],
    "dataSocialImpact": "Recognition of drones serves the safety of the low airspace. The same "
    "methods can monitor the movements of people.",
    "personalSensitiveInformation": [
        "None is simulated. Recordings of gaits that a user adds keep their own terms."
    ],
    "dataReleaseMaintenancePlan": "README.md has the configuration and the version of the rules "
    "that make the same bytes again. The data set of a benchmark (lowalt-40-v1) never changes: a "
    "correction gets a new version.",
}
"""Properties of the responsible-AI vocabulary. Source: Croissant RAI specification 1.0 (MLCommons).
"""


def metadata(index: dict, table: dict, facts: dict) -> dict:
    """Return the Croissant description (JSON-LD) of a data set by its index.

    table: path, bytes and sha256 of the table of samples; facts: name, description, version,
    license, and further properties that are known (url, datePublished). Paths are relative to the
    folder of the description.
    """
    classes = ", ".join(f"{number} {name}" for number, name in enumerate(stated(index)))
    kind = index["kind"]
    inside = [{"@id": entry["name"]} for entry in index["shards"]]
    files = []
    for entry in index["shards"]:
        about = f"{entry['samples']} samples, {entry['group']} subtypes, {entry['fold']} fold."
        files.append(_file(entry, "application/x-tar", about))
    about = "One row per sample: key, class, SNR, shard."
    files.append(_file({**table, "name": table["path"]}, "text/csv", about))
    mime, meaning = MEDIA[kind]
    size = index["render"]["images"]["size"]
    stations = len(index["render"]["network"]["stations"])
    spectra = [name.upper() for name in named(index["render"]["spectra"])]
    meaning = meaning.format(len(spectra) * size, stations * size, ", ".join(spectra))
    about = f"JSON record of every {OF[kind]}: motion, geometry, seed."
    sets = [
        _files("records", inside, "application/json", "*.json", about),
        _files(f"{kind}s", inside, mime, f"*.{EXTENSIONS[kind]}", meaning),
    ]
    return {
        "@context": CONTEXT,
        "@type": "sc:Dataset",
        **facts,
        **{f"rai:{name}": value for name, value in RESPONSIBLE.items()},
        # in no specification yet, but conferences that publish data sets ask for it
        "rai:hasSyntheticData": True,
        "conformsTo": [
            "http://mlcommons.org/croissant/1.1",
            "http://mlcommons.org/croissant/RAI/1.0",
        ],
        "isLiveDataset": False,
        "distribution": files + sets,
        "recordSet": [_samples(table["path"], classes)],
    }


def _file(entry: dict, mime: str, meaning: str) -> dict:
    """One file, with its size and checksum."""
    return {
        "@type": "cr:FileObject",
        "@id": entry["name"],
        "name": entry["name"],
        "contentUrl": entry["path"],
        "contentSize": f"{entry['bytes']} B",
        "encodingFormat": mime,
        "sha256": entry["sha256"],
        "description": meaning,
    }


def _files(name: str, inside: list[dict], mime: str, pattern: str, meaning: str) -> dict:
    """All files that match `pattern` in the files or sets `inside`."""
    return {
        "@type": "cr:FileSet",
        "@id": name,
        "name": name,
        "containedIn": inside,
        "encodingFormat": mime,
        "includes": pattern,
        "description": meaning,
    }


def _samples(table: str, classes: str) -> dict:
    """The record set with one row for each sample, from the table.

    classes: with their numbers, as one text.
    """
    fields = [
        {
            "@type": "cr:Field",
            "@id": f"samples/{name}",
            "name": name,
            "description": meaning.format(classes),
            "dataType": data_type,
            "source": {"fileObject": {"@id": table}, "extract": {"column": name}},
        }
        for name, (data_type, meaning) in FIELDS.items()
    ]
    return {
        "@type": "cr:RecordSet",
        "@id": "samples",
        "name": "samples",
        "key": {"@id": "samples/key"},
        "field": fields,
        "description": "All samples with their labels, and the shard and the file that hold each. "
        "Records with images or signals: datasets.load_dataset, which streams the shards "
        "(README.md).",
    }
