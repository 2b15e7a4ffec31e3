"""The fast kernel: short polynomials for functions, a proved strongest cell, errors bounded beforehand."""
