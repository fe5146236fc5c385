"""What is asked on the command line: options, words and files as parts of requests, and the way to answers."""
