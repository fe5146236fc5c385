"""Safety bubbles along a path or for a history of poses."""
