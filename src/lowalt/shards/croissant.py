"""Croissant metadata of a data set: its shards with checksums, and its samples as records that tools can load.

Source: Croissant format specification 1.1 (MLCommons).
"""

from lowalt.config.classes import stated
from lowalt.shards.sample_table import EXTENSIONS
from lowalt.spectra.catalogue import named

TERMS = """
    arrayShape citeAs column containedIn dataBiases dataCollection equivalentProperty extract field fileObject
    fileProperty fileSet format includes isArray isLiveDataset jsonPath key md5 parentField path
    personalSensitiveInformation recordSet references regex repeated replace samplingRate separator source subField
    transform
"""
"""Words of the format that stand for themselves."""
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
    "group": ("sc:Text", "Whether the unseen protocol trains on the subtype (seen) or only tests on it (unseen)."),
    "fold": ("sc:Text", "train, val or test."),
    "model": ("sc:Integer", "Number of the motion model within its subtype."),
    "snr_db": ("sc:Float", "Signal-to-noise ratio in dB, or inf."),
    "shard": ("sc:Text", "Shard that holds the sample's members KEY.json and its image or signal."),
    "file": ("sc:Text", "Name of the sample's image or signal in the shard."),
}
"""Columns of the table of all samples: data type and meaning; the label's meaning names the classes."""

ARRAY = "application/octet-stream", "sc:Text"
MEDIA = {
    "image": ("image/png", "sc:ImageObject", "{} x {} palette PNG: rows are stations, columns {}."),
    "signal": (*ARRAY, "Signals (stations, symbols, re and im), float32, as an .npy file."),
    "cube": (*ARRAY, "Range cells with noise (stations, symbols, cells, re and im), float32 or int16 times the "
             "record's step, as an .npy file."),
    "recipe": (*ARRAY, "Echoes without noise of a motion model (stations, symbols, re and im), float32, as an .npy "
               "file."),
}  # fmt: skip
"""Media type, Croissant's data type, and meaning of the member next to the record, by kind of shards."""
OF = {"image": "sample", "signal": "sample", "cube": "sample", "recipe": "motion model"}
"""The set of records that one member of a shard belongs to; the SNRs of a motion model share one in recipe shards."""


def metadata(index: dict, table: dict, facts: dict) -> dict:
    """Return the Croissant description (JSON-LD) of a data set by its index.

    table: path, bytes and sha256 of the table of samples; facts: name, description, version, license, and further
    properties that are known (url, datePublished). Paths are relative to the folder of the description.
    """
    classes = ", ".join(f"{number} {name}" for number, name in enumerate(stated(index)))
    kind, inside = index["kind"], [{"@id": entry["name"]} for entry in index["shards"]]
    files = [
        _file(entry, "application/x-tar",
              f"{entry['samples']} samples, {entry['group']} subtypes, {entry['fold']} fold.")
        for entry in index["shards"]
    ]  # fmt: skip
    files.append(_file({**table, "name": table["path"]}, "text/csv", "One row a sample: key, class, SNR, shard."))
    mime, data_type, meaning = MEDIA[kind]
    size, stations = index["render"]["images"]["size"], len(index["render"]["network"]["stations"])
    spectra = [name.upper() for name in named(index["render"]["spectra"])]
    meaning = meaning.format(len(spectra) * size, stations * size, ", ".join(spectra))
    about = f"JSON record of every {OF[kind]}: motion, geometry, seed."
    sets = [
        _files("records", inside, "application/json", "*.json", about),
        _files(f"{kind}s", inside, mime, f"*.{EXTENSIONS[kind]}", f"The {kind} of every {OF[kind]}."),
    ]
    return {
        "@context": CONTEXT,
        "@type": "sc:Dataset",
        **facts,
        "conformsTo": "http://mlcommons.org/croissant/1.1",
        "isLiveDataset": False,
        "distribution": files + sets,
        "recordSet": [_samples(table["path"], classes), _labelled(kind, table["path"], classes, data_type, meaning)],
    }


def _file(entry: dict, mime: str, meaning: str) -> dict:
    """One file, with its size and checksum."""
    return {
        "@type": "cr:FileObject", "@id": entry["name"], "name": entry["name"], "contentUrl": entry["path"],
        "contentSize": f"{entry['bytes']} B", "encodingFormat": mime, "sha256": entry["sha256"], "description": meaning,
    }  # fmt: skip


def _files(name: str, inside: list[dict], mime: str, pattern: str, meaning: str) -> dict:
    """All files that match `pattern` in the files or sets `inside`."""
    return {
        "@type": "cr:FileSet", "@id": name, "name": name, "containedIn": inside, "encodingFormat": mime,
        "includes": pattern, "description": meaning,
    }  # fmt: skip


def _records(name: str, meaning: str, fields: list[dict], **more: dict) -> dict:
    """A set of records with these fields."""
    fields = [{"@type": "cr:Field", "@id": f"{name}/{field['name']}", **field} for field in fields]
    return {
        "@type": "cr:RecordSet", "@id": name, "name": name, **more, "description": meaning, "field": fields,
    }  # fmt: skip


def _column(table: str, name: str, classes: str) -> dict:
    """A field that is a column of the table of samples."""
    data_type, meaning = FIELDS[name]
    source = {"fileObject": {"@id": table}, "extract": {"column": name}}
    return {"name": name, "description": meaning.format(classes), "dataType": data_type, "source": source}


def _samples(table: str, classes: str) -> dict:
    """The record set with one row for each sample, from the table; classes: with their numbers, as one text."""
    fields = [_column(table, name, classes) for name in FIELDS]
    meaning = "All samples, without their images or signals."
    return _records("samples", meaning, fields, key={"@id": "samples/key"})


def _labelled(kind: str, table: str, classes: str, data_type: str, meaning: str) -> dict:
    """The record set with one row for each sample: its image, signal or echo next to what the table says of it."""

    def member(name: str) -> dict:
        """A property of a member of the shards."""
        return {"fileSet": {"@id": f"{kind}s"}, "extract": {"fileProperty": name}}

    file = _column(table, "file", classes)
    fields = [
        {**file, "source": member("filename"), "references": file["source"]},
        *(_column(table, name, classes) for name in ("key", "label", "category", "snr_db")),
        {"name": "content", "description": meaning, "dataType": data_type, "source": member("content")},
    ]
    return _records("labelled", f"The {kind} of every sample with its label.", fields)
