"""A network that takes in measured heights next to its images: its weights, its trainings, and who is refused."""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch

from lowalt.common.errors import InputError
from lowalt.common.streams import stream
from lowalt.recognition import checkpoint, height_cue, methods, one_sample, recipe, runs, samples, schemes
from lowalt.recognition.__main__ import main
from lowalt.recognition.export import export
from lowalt.recognition.height_cue import WithHeight
from lowalt.recognition.tracked import Tracked
from trainings import SETTINGS, equal, with_training

CUED = schemes.Scheme("AB:VRP height", (0, 1), (0,), cues="height")
PLAIN = replace(CUED, name="AB:VRP", cues="")


def network(scheme):
    """A network with fresh weights, the same for equal schemes."""
    recipe.seeded(3, ("height",), 1)
    return methods.built(scheme, {**SETTINGS["network"], "dropout": 0.0}, 32, "gray", 4).eval()


def images(count, views=2):
    return torch.from_numpy(stream(1, "images").integers(0, 256, (count, views, 32, 32)).astype(np.uint8))


@torch.inference_mode()
def test_a_cue_adds_its_own_weights_alone_and_stations_stay_a_set():
    plain, cued, given = network(PLAIN), network(CUED), images(5)
    heights = torch.tensor([[0.0, 60.0]] * 5)
    theirs, own = plain.state_dict(), cued.state_dict()
    assert equal(theirs, {name: value for name, value in own.items() if not name.startswith("height.")})
    assert len(own) == len(theirs) + 4
    found = cued(WithHeight(given, heights))
    torch.testing.assert_close(cued(WithHeight(given.flip(1), heights.flip(1))), found, atol=1e-5, rtol=1e-5)
    assert not torch.allclose(cued(WithHeight(given, heights.flip(1))), found, atol=1e-4)
    _, alone = cued(WithHeight(given, heights), alone=True)
    one = cued(WithHeight(given[:, 1:], heights[:, 1:]))
    torch.testing.assert_close(alone.view(5, 2, 4)[:, 1], one, atol=1e-5, rtol=1e-5)
    for model, inputs in ((cued, given), (plain, WithHeight(given, heights))):
        with pytest.raises(InputError, match="network: "):
            model(inputs)


@torch.inference_mode()
def test_fifty_metres_enter_the_network_as_one_and_pass_sixteen_values():
    cue = height_cue.HeightCue(8)
    heights = torch.tensor([[0.0, 50.0, 125.0]])
    first, last = cue.layers[0], cue.layers[2]
    wanted = last(torch.nn.functional.gelu(torch.tensor([[[0.0], [1.0], [2.5]]]) @ first.weight.T + first.bias))
    torch.testing.assert_close(cue(heights), wanted)
    assert first.weight.shape == (16, 1) and wanted.shape == (1, 3, 8)


def test_a_scheme_without_cues_is_kept_as_before_there_were_any():
    keys = ["name", "stations", "spectra", "fusion", "backbone", "protocols", "size", "steps", "share", "method"]
    assert list(PLAIN.record) == keys and list(CUED.record) == [*keys, "cues"]
    assert schemes.of_record(PLAIN.record) == PLAIN and schemes.of_record(CUED.record) == CUED


@pytest.fixture(scope="module")
def blank(tmp_path_factory):
    """Images that say nothing, and tracks whose heights tell four classes apart; a table of schemes, and settings."""
    folder = tmp_path_factory.mktemp("blank")
    rng, rows = stream(8, "noise"), []
    for label in range(4):
        for model in range(12):
            fold = ("val", "test", "train", "train", "train", "train")[model % 6]
            rows.append((f"s{label}-{model}", f"s{label}", model, 3.0, "seen", fold, label))
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    nan, pixels = np.full((48, 3), np.nan), np.zeros((48, 9, 16, 16), np.uint8)
    samples.write(folder / "views.npz", pixels, samples.Facts(*columns, nan, nan))
    heights = 40.0 * columns[-1][:, None] + 3 * rng.standard_normal((48, 3))
    order = rng.permutation(48)
    np.savez(folder / "tracks.npz", key=columns[0][order], height_m=heights[order], range_m=heights[order])
    (folder / "schemes.csv").write_text(
        ",".join((*schemes.COLUMNS, "cues")) + "\nAB:VRP height,AB,VRP,attention,,seen,height\n"
        "AB:VRP,AB,VRP,attention,,seen,\n"
    )
    return folder


def trained(folder, out, *more, scheme="AB:VRP height", **changes):
    """Train from the command line; return the model."""
    settings = with_training(**{"steps": 1, "validate_every": 1, "accumulate": 2, **changes})
    settings |= {"size": 16}
    main([
        "train", "--settings", json.dumps(settings), "--views", str(folder / "views.npz"), "--schemes",
        str(folder / "schemes.csv"), "--stations", "A", "B", "C", "--protocol", "seen", "--scheme", scheme,
        "--out", str(out), *more,
    ])  # fmt: skip
    return out / "model.pt"


class NoEyes(torch.nn.Module):
    """A backbone that sees nothing."""

    def forward(self, pixels):
        return torch.zeros(len(pixels), 64)


def test_a_network_that_ignores_its_images_tells_classes_apart_by_height():
    model, rng = network(CUED), stream(2, "heights")
    model.backbone = NoEyes()
    steps = torch.optim.Adam(model.parameters(), 1e-2)

    def drawn(count):
        """Heights on the ground, of birds, of craft, and far above, within some metres; labels."""
        label = torch.from_numpy(rng.integers(0, 4, count))
        error = 3 * torch.from_numpy(rng.standard_normal((count, 2))).float()
        heights = torch.tensor([0.0, 40, 90, 150])[label, None] + error
        return WithHeight(images(1).expand(count, -1, -1, -1), heights), label

    for _ in range(60):
        given, label = drawn(32)
        steps.zero_grad()
        torch.nn.functional.cross_entropy(model(given), label).backward()
        steps.step()
    given, label = drawn(200)
    assert (model(given).argmax(1) == label).float().mean() > 0.9


def test_a_model_evaluates_with_the_heights_it_is_given(blank, tmp_path):
    model = trained(blank, tmp_path, "--tracks", str(blank / "tracks.npz"))
    with np.load(blank / "tracks.npz") as data:
        np.savez(tmp_path / "others.npz", **{**data, "height_m": data["height_m"] + 50})
    settings = json.dumps({"batch": 8, "threads": 1, "precision": "fp32", "mirror": True})
    line = ["evaluate", "--settings", settings, "--views", str(blank / "views.npz"), "--model", str(model)]
    told = []
    for path in (blank / "tracks.npz", tmp_path / "others.npz"):
        main([*line, "--tracks", str(path), "--out", str(tmp_path / "told.csv")])
        told.append((tmp_path / "told.csv").read_text())
    assert told[0] != told[1] and told[0].count("\n") == told[1].count("\n") == 17
    name, state = checkpoint.load(model)
    assert json.loads(name)["scheme"]["cues"] == state["scheme"]["cues"] == "height"
    with pytest.raises(InputError, match="--tracks: scheme 'AB:VRP height' has the cue 'height'"):
        main([*line, "--out", str(tmp_path / "none.csv")])
    for ask in (lambda: one_sample.predict(runs.load(model), tmp_path / "a.npy", {}),
                lambda: export(runs.load(model), tmp_path / "model.onnx")):  # fmt: skip
        with pytest.raises(InputError, match="scheme 'AB:VRP height' has the cue 'height', expected one without"):
            ask()


def test_identity_holds_the_heights_and_a_missing_one_is_refused(blank, tmp_path):
    source = samples.ViewSamples([blank / "views.npz"], CUED.columns, {("seen", "train")})
    before = Tracked(source, [blank / "tracks.npz"], (0, 1))
    assert before.sha256() != source.sha256()
    with np.load(blank / "tracks.npz") as data:
        kept = dict(data)
    wanted = dict(zip(kept["key"].tolist(), kept["height_m"][:, :2].astype(np.float32).tolist(), strict=True))
    assert before.height_m.tolist() == [wanted[key] for key in before.facts.key.tolist()]
    before.keep(np.array([4, 1]))
    assert before.height_m.tolist() == [wanted[key] for key in before.facts.key.tolist()] and len(before.facts) == 2
    narrow = {name: kept[name][:, :1] for name in ("height_m", "range_m")}
    for change, words in (({"key": kept["key"][::-1]}, None), (narrow, "of 1 stations"),
                          ({key: values[:9] for key, values in kept.items()}, "no height of sample"),
                          ({"height_m": np.full((48, 3), np.nan)}, "expected finite ones")):  # fmt: skip
        np.savez(tmp_path / "tracks.npz", **{**kept, **change})
        fresh = samples.ViewSamples([blank / "views.npz"], CUED.columns, {("seen", "train")})
        if words is None:
            one, other = (Tracked(fresh, [path / "tracks.npz"], (0, 1)).sha256() for path in (tmp_path, blank))
            assert one != other
        else:
            with pytest.raises(InputError, match=words):
                Tracked(fresh, [tmp_path / "tracks.npz"], (0, 1))


@pytest.mark.parametrize(
    ("more", "words"),
    [([], "--tracks: scheme 'AB:VRP height' has the cue"),
     (["--tracks", "{}/tracks.npz", "--extra", "a.npz"], "--extra-tracks: scheme 'AB:VRP height' has the cue"),
     (["--tracks", "{}/tracks.npz", "--stream", "a.yaml"], "--stream: scheme 'AB:VRP height' has the cue"),
     (["--tracks", "{}/tracks.npz", "--start", "{}/plain/model.pt"], "seen/AB:VRP has another cues")],
)  # fmt: skip
def test_trainings_that_cannot_have_a_height_are_refused_by_name(blank, tmp_path, more, words):
    if "--start" in more and not (blank / "plain").exists():
        trained(blank, blank / "plain", scheme="AB:VRP")
        with pytest.raises(InputError, match="--tracks: scheme 'AB:VRP' has no cue"):
            trained(blank, tmp_path, "--tracks", str(blank / "tracks.npz"), scheme="AB:VRP")
    with pytest.raises(InputError, match=words):
        trained(blank, tmp_path, *(text.format(blank) for text in more))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("changes", "words"),
    [({"cues": "speed"}, "cues 'speed', expected nothing or one of"),
     ({"fusion": "mean"}, "cues 'height' with fusion 'mean', expected 'attention'"),
     ({"method": "cnn", "spectra": ""}, "cues 'height' with method 'cnn', expected 'none'"),
     ({"scheme": "AB:VRP"}, "expected the word in the scheme's name 'AB:VRP'")],
)  # fmt: skip
def test_rows_that_contradict_their_cues_are_refused_by_name(changes, words):
    row = {"scheme": "A height", "stations": "A", "spectra": "VRP", "fusion": "attention", "backbone": ""}
    assert schemes.scheme({**row, "protocols": "seen", "cues": "height"}, "test", "ABC").cues == "height"
    with pytest.raises(InputError, match=words):
        schemes.scheme({**row, "protocols": "seen", "cues": "height", **changes}, "test", "ABC")


def test_measured_inputs_are_cut_and_moved_together():
    given = WithHeight(images(5), torch.arange(10.0).view(5, 2))
    parts = given.to(torch.device("cpu")).chunk(2)
    assert [len(part.images) for part in parts] == [len(part.height_m) for part in parts] == [3, 2]
    assert parts[1].height_m.tolist() == [[6, 7], [8, 9]] and given.shape == given.images.shape
    turned = network(CUED).mirrored(given)
    assert torch.equal(turned.images, given.images.flip(-2)) and torch.equal(turned.height_m, given.height_m)
    assert height_cue.HeightCue(8)(given.height_m).shape == (5, 2, 8)
