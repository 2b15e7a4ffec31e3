"""The fast kernel: short polynomials in place of functions, a proved strongest cell, errors bounded beforehand."""
