"""Double-double numbers.

Constants, arithmetic and sines that give the same bits on every processor.
"""
