"""``python -m service.cli`` is ``sightline``: how the demo starts the service with its own interpreter."""

from . import main

if __name__ == "__main__":
    main()
