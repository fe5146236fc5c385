"""Ground of any size and place."""
