"""Files for other tools: SigMF recordings of signals (`python -m lowalt.extensions.formats.sigmf`)."""
