"""Commands for the field: what is in a log, and links to autopilots and radios."""
