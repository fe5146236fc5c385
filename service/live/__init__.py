"""Live detector sessions: in memory, bounded in number, size and idle time, answering each epoch at once."""
