"""What stands on the ground: buildings."""
