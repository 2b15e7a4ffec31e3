"""The fast kernel: short polynomials replace functions, the strongest cell is proved, errors are
bounded beforehand.
"""
