"""A network of a radar that is trained for two steps on its twin, and kept as the zoo keeps its own, names windows."""

import numpy as np
import yaml
from scipy.io import wavfile
from twin_networks import main

from lowalt.__main__ import main as lowalt
from lowalt.files.yaml_files import load_yaml


def test_a_kept_network_names_every_window_of_a_recording(tmp_path, capsys):
    block = load_yaml("config/measured/recognition.yaml")
    block |= {"size": 24, "echoes": {"train": 2, "validation": 1}, "receivers": 1, "seeds": [0]}
    block["training"] |= {"steps": 2, "batch": 4, "validate_every": 1}
    (tmp_path / "recognition.yaml").write_text(yaml.safe_dump(block))
    twins = load_yaml("config/measured/twins.yaml")
    twins["twins"] = {"cw_24ghz": twins["twins"]["cw_24ghz"]}
    for block in (twins, *twins["twins"].values()):
        for scene in (scene for scenes in block["scenes"].values() for scene in scenes):
            scene["subtypes"] = scene["subtypes"][:1]
    (tmp_path / "twins.yaml").write_text(yaml.safe_dump(twins))
    options = {"twins": "twins.yaml", "recognition": "recognition.yaml", "models": "models", "out": "zoo"}
    main([word for name, value in options.items() for word in (f"--{name}", str(tmp_path / value))])
    assert {path.name for path in (tmp_path / "zoo").iterdir()} == {"cw_24ghz.md", "cw_24ghz.safetensors"}
    wavfile.write(tmp_path / "noise.wav", 12000, np.random.default_rng(0).normal(0, 0.1, 12000).astype(np.float32))
    said = "file: noise.wav\ncarrier_hz: 24.0e+9\nchannel: real\nsource: made here\nlicence: MIT\n"
    (tmp_path / "noise.yaml").write_text(said)
    capsys.readouterr()
    assert lowalt(["predict", str(tmp_path / "zoo/cw_24ghz.safetensors"), str(tmp_path / "noise.yaml")]) == 0
    assert "nothing there: none of 2 windows" in capsys.readouterr().out
