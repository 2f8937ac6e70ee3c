"""How kernels become native code: words of the ABI, the compiler, the object cache."""
