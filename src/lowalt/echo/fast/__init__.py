"""The fast kernel: polynomials replace functions, strongest cells and error bounds are proved."""
