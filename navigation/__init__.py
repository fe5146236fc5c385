"""Navigation filters, safety bubble and measurement quality monitoring."""

__all__: list[str] = []
