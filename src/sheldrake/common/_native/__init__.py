"""How kernels become native code: words of the ABI, lowering through numba, the object cache."""
