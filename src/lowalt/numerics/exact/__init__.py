"""Double-double numbers.

Their constants, arithmetic and sines give the same bits on every processor.
"""
