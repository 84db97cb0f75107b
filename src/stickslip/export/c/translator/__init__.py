"""Translation of compiled kernels to C99."""
