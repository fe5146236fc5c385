"""Commands for who runs the service: serving, and looking after what it keeps."""
