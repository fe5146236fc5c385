"""Ground from elsewhere: files under a naming scheme on a server that the operator lists, read by parts and kept."""
