"""The only place that knows Numba's insides: how kernels are declared, called from Python, kept, shared out to threads."""
