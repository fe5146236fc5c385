"""The service as its clients see it, in peace and under attack."""
