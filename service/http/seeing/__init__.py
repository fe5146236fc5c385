"""What an operator sees of requests: ids, the access log, metrics."""
