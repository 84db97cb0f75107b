"""C99 code of friction, its estimation and its control, translated from the kernels."""
