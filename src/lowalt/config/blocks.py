"""Values that follow from several blocks of a configuration."""

from lowalt.files.errors import InputError


def snrs_of(config: dict) -> tuple[float, ...]:
    """Return all SNRs (dB) of a configuration, those added later last.

    Raises: InputError where an SNR stands twice.
    """
    snrs = []
    for step in (config["noise"], *config.get("added", [])):
        snrs += [float(snr) for snr in step.get("snr_db", [])]
    if len(set(snrs)) < len(snrs):
        raise InputError(f"noise.snr_db: value {snrs}, expected every SNR once")
    return tuple(snrs)


def motion_block(config: dict) -> dict:
    """Return the block `motion` of a configuration.

    Where it has `looks`, the block gets the key look_s, the length of a look (s).
    """
    motion = config["motion"]
    if "looks" not in motion:
        return motion
    network = config["network"]
    return motion | {"look_s": network["symbols"] * network["symbol_interval_s"]}


def render_blocks(config: dict) -> dict:
    """Return the blocks of a configuration that say how signals become images."""
    return {name: config[name] for name in ("network", "spectra", "images")}
