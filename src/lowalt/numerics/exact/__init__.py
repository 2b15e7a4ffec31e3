"""Double-double numbers: constants, arithmetic and sines that give the same bits on every
processor.
"""
