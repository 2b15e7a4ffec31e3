"""Effects on the time samples of the OFDM symbols: noise, offsets, oscillator, mixer, converter."""
