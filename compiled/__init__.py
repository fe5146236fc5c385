"""What every kernel stands on: how kernels are compiled, vectors, fresh memory, read-only arrays."""
