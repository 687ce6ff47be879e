"""The only place that knows Numba's insides: how kernels are declared, called, kept and shared out to threads."""
