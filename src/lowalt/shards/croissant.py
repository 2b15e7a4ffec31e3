"""Croissant metadata of a data set: its shards with checksums, and its samples as records that tools can load.

Source: Croissant format specification 1.1 (MLCommons).
"""

from lowalt.config.classes import stated
from lowalt.shards.table import EXTENSIONS
from lowalt.spectra.catalogue import named

CONTEXT = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "arrayShape": "cr:arrayShape",
    "citeAs": "cr:citeAs",
    "column": "cr:column",
    "conformsTo": "dct:conformsTo",
    "containedIn": "cr:containedIn",
    "cr": "http://mlcommons.org/croissant/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataBiases": "cr:dataBiases",
    "dataCollection": "cr:dataCollection",
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "equivalentProperty": "cr:equivalentProperty",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "extract": "cr:extract",
    "field": "cr:field",
    "fileObject": "cr:fileObject",
    "fileProperty": "cr:fileProperty",
    "fileSet": "cr:fileSet",
    "format": "cr:format",
    "includes": "cr:includes",
    "isArray": "cr:isArray",
    "isLiveDataset": "cr:isLiveDataset",
    "jsonPath": "cr:jsonPath",
    "key": "cr:key",
    "md5": "cr:md5",
    "parentField": "cr:parentField",
    "path": "cr:path",
    "personalSensitiveInformation": "cr:personalSensitiveInformation",
    "recordSet": "cr:recordSet",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "references": "cr:references",
    "regex": "cr:regex",
    "repeated": "cr:repeated",
    "replace": "cr:replace",
    "samplingRate": "cr:samplingRate",
    "sc": "https://schema.org/",
    "separator": "cr:separator",
    "source": "cr:source",
    "subField": "cr:subField",
    "transform": "cr:transform",
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

MEDIA = {
    "image": ("image/png", "sc:ImageObject", "{} x {} palette PNG: rows are stations, columns {}."),
    "signal": (
        "application/octet-stream",
        "sc:Text",
        "Signals (stations, symbols, re and im), float32, as an .npy file.",
    ),
    "cube": (
        "application/octet-stream",
        "sc:Text",
        "Range cells with noise (stations, symbols, cells, re and im), float32, as an .npy file.",
    ),
    "recipe": (
        "application/octet-stream",
        "sc:Text",
        "Echoes without noise of a motion model (stations, symbols, re and im), float32, as an .npy file.",
    ),
}
OF = {"image": "sample", "signal": "sample", "cube": "sample", "recipe": "motion model"}
"""The set of records that one member of a shard belongs to; the SNRs of a motion model share one in recipe shards."""


def metadata(index: dict, table: dict, facts: dict) -> dict:
    """Return the Croissant description (JSON-LD) of a data set by its index.

    table: path, bytes and sha256 of the table of samples; facts: name, description, version, license, and further
    properties that are known (url, datePublished). Paths are relative to the folder of the description.
    """
    kind = index["kind"]
    files = [
        _file(
            entry, "application/x-tar", f"{entry['samples']} samples, {entry['group']} subtypes, {entry['fold']} fold."
        )
        for entry in index["shards"]
    ]
    files.append(_file({**table, "name": table["path"]}, "text/csv", "One row a sample: key, class, SNR, shard."))
    mime, data_type, meaning = MEDIA[kind]
    size, stations = index["render"]["images"]["size"], len(index["render"]["network"]["stations"])
    spectra = [name.upper() for name in named(index["render"]["spectra"])]
    meaning = meaning.format(len(spectra) * size, stations * size, ", ".join(spectra))
    inside = [{"@id": entry["name"]} for entry in index["shards"]]
    sets = [
        _files(
            "records", inside, "application/json", "*.json", f"JSON record of every {OF[kind]}: motion, geometry, seed."
        ),
        _files(f"{kind}s", inside, mime, f"*.{EXTENSIONS[kind]}", f"The {kind} of every {OF[kind]}."),
    ]
    return {
        "@context": CONTEXT,
        "@type": "sc:Dataset",
        **facts,
        "conformsTo": "http://mlcommons.org/croissant/1.1",
        "isLiveDataset": False,
        "distribution": files + sets,
        "recordSet": [_samples(table["path"], stated(index)), _labelled(kind, table["path"], data_type, meaning)],
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


def _samples(path: str, classes: tuple[str, ...]) -> dict:
    """The record set with one row for each sample, from the table."""
    named = ", ".join(f"{number} {name}" for number, name in enumerate(classes))
    fields = [
        {
            "@type": "cr:Field", "@id": f"samples/{name}", "name": name,
            "description": meaning.format(named), "dataType": kind,
            "source": {"fileObject": {"@id": path}, "extract": {"column": name}},
        }
        for name, (kind, meaning) in FIELDS.items()
    ]  # fmt: skip
    return {
        "@type": "cr:RecordSet", "@id": "samples", "name": "samples", "key": {"@id": "samples/key"},
        "description": "All samples, without their images or signals.", "field": fields,
    }  # fmt: skip


def _labelled(kind: str, path: str, data_type: str, meaning: str) -> dict:
    """The record set with one row for each sample: its image, signal or echo next to what the table says of it."""
    name = f"{kind}s"

    def field(part: str, what: str, text: str, source: dict) -> dict:
        """One field of the set."""
        return {
            "@type": "cr:Field", "@id": f"labelled/{part}", "name": part, "description": text, "dataType": what,
            "source": source,
        }  # fmt: skip

    def table(part: str) -> dict:
        """A column of the table of samples."""
        return {"fileObject": {"@id": path}, "extract": {"column": part}}

    def member(part: str) -> dict:
        """A property of a member of the shards."""
        return {"fileSet": {"@id": name}, "extract": {"fileProperty": part}}

    fields = [
        field("file", *FIELDS["file"], member("filename")) | {"references": table("file")},
        *(field(part, *FIELDS[part], table(part)) for part in ("key", "label", "category", "snr_db")),
        field("content", data_type, meaning, member("content")),
    ]
    return {
        "@type": "cr:RecordSet", "@id": "labelled", "name": "labelled",
        "description": f"The {kind} of every sample with its label.", "field": fields,
    }  # fmt: skip
