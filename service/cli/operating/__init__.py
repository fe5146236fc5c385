"""Commands for who runs the service: serving, keys, and looking after what it keeps."""
