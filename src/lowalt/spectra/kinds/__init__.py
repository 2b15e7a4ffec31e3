"""The spectra, one module each; `lowalt.spectra.interface` says what a module holds."""
