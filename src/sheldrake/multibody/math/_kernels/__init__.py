"""What planning asks of many configurations at once, as kernels."""
