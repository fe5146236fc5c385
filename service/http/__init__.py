"""The HTTP service: routes, problems, uploads and the app they make."""
