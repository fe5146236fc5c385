"""Jobs: their store, the folder they live in, and the worker processes that calculate them."""
