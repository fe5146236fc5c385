"""What keeps the data folder within its room: retention of results, and space on the disk."""
