"""What the service may take of its machine, and how its processes share it."""
